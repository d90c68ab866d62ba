#pragma once

#include <vector>

#include <Eigen/Core>

#include "scenes/scene_builders.h"
#include "vcharge_simulation/vehicle/drive_path.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// Lanes of a car park with two blocks of bays: along y = -y_m, 0 and y_m, joined at x = -x_m and x_m.
/// Corners suit a car of the Golf's size.
struct Lanes {
  double x_m = 26.0;
  double y_m = 15.0;
  double corner_radius_m = 5.2;

  /// Path around both blocks, starting and ending in the middle of the southern lane, shifted outwards by
  /// `outwards_m`.
  DrivePath loop(const Eigen::Vector2d& outwards_m, bool clockwise) const;
  /// Path counter-clockwise around the northern block, then clockwise around the southern one.
  DrivePath figureEight() const;
  /// All lanes in both directions without turning on the spot: counter-clockwise around both blocks, then
  /// through the middle lane, clockwise around both blocks, and back through the middle lane. The outer lanes
  /// are shifted outwards by `outwards_m`.
  DrivePath bothDirections(const Eigen::Vector2d& outwards_m) const;

 private:
  DrivePath through(const std::vector<Eigen::Vector2d>& waypoints, bool closed) const;
};

/// Path of 15 m with gentle curves to either side.
DrivePath gentleCurves(const RigidTransform& world_from_start);
/// Path east along the lane at y = lane_y_m, past the bay at x = bay_x_m on its northern side, then backwards
/// into the bay. `approach_m` is driven before reversing.
DrivePath reverseIntoBay(double bay_x_m, double lane_y_m, double approach_m);
/// Path from the end of reverseIntoBay() out of the bay and west along the lane, `leave_m` beyond the curve.
DrivePath leaveBayWestwards(double bay_x_m, double lane_y_m, double leave_m);

/// Path into a bay at x = bay_x_m on the northern side of the lane, backwards, a stop, and out of it
/// westwards.
DrivePath visitBayBackwards(double bay_x_m, double lane_y_m);
/// Path along the eastern lane of `lanes` northwards past the middle lane, backwards into that, and back
/// southwards: a turn in three moves.
DrivePath threePointTurn(const Lanes& lanes);
/// Path east along the lane at y = lane_y_m, to the right into a space whose middle line is at x = space_x_m
/// and ends `depth_m` south of the lane; a stop, backwards out of it, and back westwards.
DrivePath visitSpaceForwards(double space_x_m, double lane_y_m, double depth_m);

/// Path of 38 m straight ahead with five stops.
DrivePath stopAndGo(const RigidTransform& world_from_start);
/// Path of 10 m straight ahead with a stop of five minutes after 7 m.
DrivePath arriveAndStand(const RigidTransform& world_from_start);
/// Path for a car that stands, see standing().
DrivePath standingPath(const RigidTransform& world_from_vehicle);
VehicleMotionOptions standing(double duration_s);

/// Motion that starts from standstill and stops at the end of the path.
VehicleMotionOptions fromRestToRest(double cruise_speed_m_per_s = 2.5);

/// The drives that all car parks have: along their middle lane, or at rest in it.
std::vector<SceneDrive> middleLaneDrives();

}  // namespace vcharge
