#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// Which ground a camera cannot have seen for the obstacles that stand before it, as far as others know of
/// them. Stereo may say otherwise: under the body of a car, which stands on its wheels, the ground does show.
class GroundShadows {
 public:
  /// Height of the camera above the ground.
  explicit GroundShadows(double camera_height_m);

  /// A square cell with something on it; offset_m: of its middle from the camera, in the axes of all offsets.
  void add(const Eigen::Vector2d& offset_m, double cell_m, double height_m);
  /// Whether the sight to the ground at an offset passes through something.
  bool hides(const Eigen::Vector2d& offset_m) const;

 private:
  static int directionOf(double angle_rad);

  double camera_height_m_;
  std::vector<std::vector<std::pair<double, double>>> hidden_m_;  // from, to; by direction
};

}  // namespace vcharge
