#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// Ground that obstacles in the map hide from a camera. Range maps may show it nevertheless: ground under the
/// body of a car is visible, but not free.
class GroundShadows {
 public:
  explicit GroundShadows(double camera_height_m);  ///< height above the ground

  /// Adds an obstacle in a square cell. offset_m: from the camera to the cell's middle; all offsets have
  /// the same axes.
  void add(const Eigen::Vector2d& offset_m, double cell_m, double height_m);
  /// Whether the line of sight to the ground at an offset passes through an obstacle.
  bool hides(const Eigen::Vector2d& offset_m) const;

 private:
  static int directionOf(double angle_rad);

  double camera_height_m_;
  std::vector<std::vector<std::pair<double, double>>> hidden_m_;  // intervals [from, to] by direction
};

}  // namespace vcharge
