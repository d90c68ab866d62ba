#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "report/report_pictures.h"
#include "vcharge_calibration/rig/rig_scene.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

// Pictures of a calibration from a drive, as <svg> elements.

/// Landmarks from above in the colour of the camera that saw them first, and the path.
std::string drawSparseMap(const RigScene& scene);

/// Loop edges on the path: accepted, rejected, and such that only looked alike.
std::string drawLoopGraph(const MappingState& state);

/// The cameras on the vehicle from above, and where they look.
std::string drawCameras(const CameraRig& rig);

/// Errors of all observations of landmarks, projection minus observation, by camera.
std::vector<std::vector<CornerError>> errorsByCamera(const MappingData& data);
/// Mean error of the cells of a grid: what neighbouring errors have in common.
std::vector<CornerError> meanErrors(cv::Size image_size_px, const std::vector<CornerError>& errors);

/// A landmark of a map, by the camera of that map's rig that saw it first, and where it was seen from.
struct LandmarkSightings {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  size_t first_camera = 0;
  std::vector<Eigen::Vector3d> cameras_m;  ///< places, in the map, of the cameras that see it now
};

/// A calibration in a finished map from above: landmarks in the colour of their first camera, with lines to
/// the cameras that see them now. `path_m` is that of the vehicle, `camera_names` those of the map's rig, for
/// the legend.
std::string drawSightings(const std::vector<LandmarkSightings>& landmarks,
                          const std::vector<Eigen::Vector3d>& path_m,
                          const std::vector<std::string>& camera_names);

}  // namespace vcharge
