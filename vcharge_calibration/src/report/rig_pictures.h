#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "report/report_pictures.h"
#include "vcharge_calibration/rig/rig_scene.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

// Pictures of a calibration from a drive, as <svg> elements.

/// Vehicle path and landmarks from above, in the colour of the camera that observed them first.
std::string drawSparseMap(const RigScene& scene);

/// Loop edges on the path: accepted, rejected, and unverified candidates.
std::string drawLoopGraph(const ReconstructionState& state);

/// The cameras on the vehicle and their directions from above.
std::string drawCameras(const CameraRig& rig);

/// Errors of all observations of landmarks, projection minus observation, by camera.
std::vector<std::vector<CornerError>> errorsByCamera(const ReconstructionData& data);
/// Mean error in the cells of a grid.
std::vector<CornerError> meanErrors(cv::Size image_size_px, const std::vector<CornerError>& errors);

/// A landmark of a map, its first camera in the rig of that map, and the cameras that observe it now.
struct LandmarkViews {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  size_t first_camera = 0;
  std::vector<Eigen::Vector3d> cameras_m;  ///< positions of the observing cameras in the map
};

/// A calibration in a finished map from above: landmarks in the colour of their first camera, with lines to
/// the cameras that observe them now. `path_m` is the vehicle's path; `camera_names`, of the map's rig, are
/// for the legend.
std::string drawLandmarkViews(const std::vector<LandmarkViews>& landmarks,
                              const std::vector<Eigen::Vector3d>& path_m,
                              const std::vector<std::string>& camera_names);

}  // namespace vcharge
