#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_obstacles/ground_plane.h"
#include "vcharge_obstacles/step_mapper.h"

namespace vcharge {

/// Takes the points near the vehicle and near the ground out of the range maps of one camera. Immutable.
class NearHeights {
 public:
  NearHeights(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
              const VehicleOutline& outline, double reach_m);

  /// Empty where the ground plane was not measured. std::logic_error for a map of another size than the
  /// camera's.
  HeightPoints find(const RangeMap& map, const GroundPlane& ground) const;

 private:
  struct Ray {
    int32_t pixel;
    Eigen::Vector3f direction;  // unit, in the vehicle frame
  };

  cv::Size size_;
  Eigen::Vector3f position_m_;  // of the camera in the vehicle frame
  VehicleOutline outline_;
  float reach_m_;
  std::vector<Ray> rays_;  // of pixels that look below the horizon
};

}  // namespace vcharge
