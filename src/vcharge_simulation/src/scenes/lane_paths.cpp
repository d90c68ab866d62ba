#include "scenes/lane_paths.h"

#include <algorithm>
#include <vector>

namespace vcharge {

namespace {

constexpr double kTransition_m = 3.0;
constexpr double kStart_m = 12.0;  // distance of the ends of open paths from the middle

// Curve into a bay and out of it.
constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kBayCurvature_per_m = 0.2;
constexpr double kTurnIn_m = 1.0;
constexpr double kArc_m = kHalfPi / kBayCurvature_per_m - kTurnIn_m;
constexpr double kTangent_m = 5.5;
constexpr double kIntoBay_m = 1.5;

}  // namespace

DrivePath Lanes::through(const std::vector<Eigen::Vector2d>& waypoints, bool closed) const {
  return DrivePath::throughWaypoints(waypoints, closed, corner_radius_m, kTransition_m);
}

DrivePath Lanes::loop(const Eigen::Vector2d& outwards_m, bool clockwise) const {
  const double x = x_m + outwards_m.x();
  const double y = y_m + outwards_m.y();
  std::vector<Eigen::Vector2d> corners = {{x, -y}, {x, y}, {-x, y}, {-x, -y}};
  if (clockwise) {
    std::reverse(corners.begin(), corners.end());
  }
  return through(corners, true);
}

DrivePath Lanes::figureEight() const {
  return through({{-kStart_m, 0.0},
                  {x_m, 0.0},
                  {x_m, y_m},
                  {-x_m, y_m},
                  {-x_m, 0.0},
                  {x_m, 0.0},
                  {x_m, -y_m},
                  {-x_m, -y_m},
                  {-x_m, 0.0},
                  {-8.0, 0.0}},
                 false);
}

DrivePath Lanes::bothDirections(const Eigen::Vector2d& outwards_m) const {
  const double x = x_m + outwards_m.x();
  const double y = y_m + outwards_m.y();
  return through({{-kStart_m, -y},
                  {x, -y},
                  {x, y},
                  {-x, y},
                  {-x, -y},
                  {x, -y},
                  {x, 0.0},
                  {-x, 0.0},
                  {-x, y},
                  {x, y},
                  {x, -y},
                  {-x, -y},
                  {-x, 0.0},
                  {kStart_m, 0.0}},
                 false);
}

DrivePath gentleCurves(const RigidTransform& world_from_start) {
  constexpr double k = 1.0 / 22.0;
  return DrivePath(world_from_start,
                   {{3.0, 0.0, -k}, {3.0, -k, 0.0}, {3.0, 0.0, k}, {3.0, k, 0.0}, {3.0, 0.0, -k}});
}

DrivePath reverseIntoBay(double bay_x_m, double lane_y_m, double approach_m) {
  constexpr double k = kBayCurvature_per_m;
  return DrivePath(RigidTransform::planar(bay_x_m + kTangent_m - approach_m, lane_y_m, 0.0),
                   {{approach_m, 0.0, 0.0},
                    {kTurnIn_m, 0.0, k, true},
                    {kArc_m, k, k, true},
                    {kTurnIn_m, k, 0.0, true},
                    {kIntoBay_m, 0.0, 0.0, true}});
}

DrivePath leaveBayWestwards(double bay_x_m, double lane_y_m, double leave_m) {
  constexpr double k = -kBayCurvature_per_m;
  return DrivePath(RigidTransform::planar(bay_x_m, lane_y_m + kTangent_m + kIntoBay_m, -kHalfPi),
                   {{kIntoBay_m, 0.0, 0.0},
                    {kTurnIn_m, 0.0, k},
                    {kArc_m, k, k},
                    {kTurnIn_m, k, 0.0},
                    {leave_m, 0.0, 0.0}});
}

DrivePath visitBayBackwards(double bay_x_m, double lane_y_m) {
  DrivePath path = reverseIntoBay(bay_x_m, lane_y_m, 12.0);
  path.append(leaveBayWestwards(bay_x_m, lane_y_m, 8.0));
  return path;
}

DrivePath threePointTurn(const Lanes& lanes) {
  constexpr double kBefore_m = 8.0;
  constexpr double k = kBayCurvature_per_m;
  return DrivePath(RigidTransform::planar(lanes.x_m, -kBefore_m, kHalfPi),
                   {{kBefore_m + kTangent_m, 0.0, 0.0},
                    {kTurnIn_m, 0.0, k, true},
                    {kArc_m, k, k, true},
                    {kTurnIn_m, k, 0.0, true},
                    {kIntoBay_m, 0.0, 0.0, true},
                    {kIntoBay_m, 0.0, 0.0},
                    {kTurnIn_m, 0.0, -k},
                    {kArc_m, -k, -k},
                    {kTurnIn_m, -k, 0.0},
                    {kBefore_m, 0.0, 0.0}});
}

DrivePath visitSpaceForwards(double space_x_m, double lane_y_m, double depth_m) {
  constexpr double kBefore_m = 12.0;
  constexpr double k = -kBayCurvature_per_m;
  const double into_m = depth_m - kTangent_m;
  return DrivePath(RigidTransform::planar(space_x_m - kTangent_m - kBefore_m, lane_y_m, 0.0),
                   {{kBefore_m, 0.0, 0.0},
                    {kTurnIn_m, 0.0, k},
                    {kArc_m, k, k},
                    {kTurnIn_m, k, 0.0},
                    {into_m, 0.0, 0.0},
                    {into_m, 0.0, 0.0, true},
                    {kTurnIn_m, 0.0, k, true},
                    {kArc_m, k, k, true},
                    {kTurnIn_m, k, 0.0, true},
                    {kBefore_m, 0.0, 0.0, true}});
}

DrivePath stopAndGo(const RigidTransform& world_from_start) {
  DrivePath path(world_from_start, {{38.0, 0.0, 0.0}});
  for (const double at_m : {5.0, 11.0, 14.0, 23.0, 31.0}) {
    path.addStop({at_m, 1.5});
  }
  return path;
}

DrivePath arriveAndStand(const RigidTransform& world_from_start) {
  DrivePath path(world_from_start, {{10.0, 0.0, 0.0}});
  path.addStop({7.0, 300.0});
  return path;
}

DrivePath standingPath(const RigidTransform& world_from_vehicle) {
  return DrivePath(world_from_vehicle, {{1.0, 0.0, 0.0}});
}

VehicleMotionOptions standing(double duration_s) {
  VehicleMotionOptions motion;
  motion.standstill_s = motion.duration_s = duration_s;
  return motion;
}

VehicleMotionOptions fromRestToRest(double cruise_speed_m_per_s) {
  VehicleMotionOptions motion;
  motion.cruise_speed_m_per_s = cruise_speed_m_per_s;
  motion.standstill_s = 0.5;
  motion.stop_at_end = true;
  motion.duration_s = 600.0;
  return motion;
}

std::vector<SceneDrive> middleLaneDrives() {
  return {
      {{"stop_and_go", "along the middle lane with five stops"},
       [] {
         return DrivePlan{"", stopAndGo(RigidTransform::planar(-19.0, -0.3, 0.02)), fromRestToRest()};
       }},
      {{"arrive_and_stand", "10 m along the middle lane, with a stop of five minutes after 7 m"},
       [] {
         return DrivePlan{"", arriveAndStand(RigidTransform::planar(-12.0, 0.2, 0.02)), fromRestToRest(1.5)};
       }},
      {{"standing", "20 s at standstill"}, [] {
         return DrivePlan{"", standingPath(RigidTransform::planar(-5.0, 0.2, 0.1)), standing(20.0)};
       }}};
}

}  // namespace vcharge
