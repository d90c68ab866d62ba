#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_simulation/vehicle/drive_path.h"

namespace vcharge {

/// The lanes of a car park with two blocks of bays: along y = -y_m, 0 and y_m, joined at x = -x_m and x_m.
/// Paths take their corners as a car of the Golf's size does.
struct Lanes {
  double x_m = 26.0;
  double y_m = 15.0;
  double corner_radius_m = 5.2;

  /// Around both blocks, from the middle of the southern lane back to it, `outwards_m` beside the lanes.
  DrivePath loop(const Eigen::Vector2d& outwards_m, bool clockwise) const;
  /// Around the northern block to the left, then around the southern one to the right.
  DrivePath figureEight() const;
  /// All lanes in both directions, in one go without turning on the spot: counter-clockwise around both
  /// blocks, through the middle lane, clockwise around both, back through the middle lane; `outwards_m`
  /// beside the outer lanes.
  DrivePath bothDirections(const Eigen::Vector2d& outwards_m) const;

 private:
  DrivePath through(const std::vector<Eigen::Vector2d>& waypoints, bool closed) const;
};

/// East along the lane at y = lane_y_m, past the bay at x = bay_x_m on the lane's northern side, and
/// backwards into it. The first `approach_m` lead to where the car starts to reverse.
DrivePath reverseIntoBay(double bay_x_m, double lane_y_m, double approach_m);
/// From where reverseIntoBay() ends out of the bay and west along the lane: `leave_m` beyond the curve.
DrivePath leaveBayWestwards(double bay_x_m, double lane_y_m, double leave_m);

}  // namespace vcharge
