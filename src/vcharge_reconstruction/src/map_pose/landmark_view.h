#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Landmarks that a camera should see, each with the observation from the most similar direction.
struct ExpectedLandmarks {
  std::vector<size_t> observations;       ///< indices into the map's observations
  std::vector<cv::Point2f> positions_px;  ///< expected positions in the camera's image
  std::vector<double> ranges_m;
};

/// The landmarks of a map that a rig should see from a pose. All arguments must outlive this object.
class LandmarkView {
 public:
  LandmarkView(const SparseMap& map, const CameraRig& rig, const MapLocalizerOptions& options,
               const RigidTransform& map_from_vehicle);

  ExpectedLandmarks expectedIn(size_t camera) const;

 private:
  struct Source {
    size_t observation;
    double cos_angle;  ///< between the directions of the observation and the expected view
  };
  std::vector<Source> sourcesFor(const Eigen::Vector3d& camera_centre) const;

  const SparseMap& map_;
  const CameraRig& rig_;
  const RigidTransform& map_from_vehicle_;
  std::vector<size_t> keyframes_;  ///< the nearest keyframes
};

}  // namespace vcharge
