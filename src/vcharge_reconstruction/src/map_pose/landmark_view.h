#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Landmarks that a camera should see, each by the observation that was made from most nearly the same
/// direction.
struct ExpectedLandmarks {
  std::vector<size_t> observations;       ///< indices into the map's
  std::vector<cv::Point2f> positions_px;  ///< where the camera should see them
  std::vector<double> ranges_m;
};

/// What a rig should see of a map from a pose. All arguments must outlive this.
class LandmarkView {
 public:
  LandmarkView(const SparseMap& map, const CameraRig& rig, const MapLocalizerOptions& options,
               const RigidTransform& map_from_vehicle);

  ExpectedLandmarks expectedIn(size_t camera) const;

 private:
  struct Source {
    size_t observation;
    double cos_angle;  ///< between the directions from which the landmark was and would be seen
  };
  std::vector<Source> sourcesFor(const Eigen::Vector3d& camera_centre) const;

  const SparseMap& map_;
  const CameraRig& rig_;
  const MapLocalizerOptions& options_;
  const RigidTransform& map_from_vehicle_;
  std::vector<size_t> keyframes_;  ///< the nearest
};

}  // namespace vcharge
