#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Obstacles that stand still, from the last obstacle map. Nobody is seen behind them: what seems to move
/// there is an edge of a parked car that passes over what is further away.
class KnownObstacles {
 public:
  /// Replaces the obstacles by the occupied cells of a map.
  void set(const ObstacleMap& map);
  /// Whether an obstacle stands on the line on the ground from a camera to `distance_m` along a unit
  /// direction, in the map's fixed frame. What the map does not reach hides nothing.
  bool hideLine(const Eigen::Vector2d& camera_m, const Eigen::Vector2d& direction, double distance_m) const;

  /// Removes the objects that obstacles hide from every camera that points to their side.
  void removeHidden(const std::vector<RigidTransform>& fixed_from_cameras,
                    std::vector<TrackedObject>* objects) const;

 private:
  bool hide(const TrackedObject& object, const std::vector<RigidTransform>& fixed_from_cameras) const;

  cv::Mat occupied_;  // CV_8UC1, cells as in the map: not 0 for occupied cells and their neighbours
  Eigen::Vector2d origin_m_{0.0, 0.0};
  double cell_size_m_ = 1.0;
};

}  // namespace vcharge
