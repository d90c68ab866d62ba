#include <algorithm>
#include <stdexcept>

#include "vcharge_simulation/lot_scene.h"

namespace vcharge {

namespace {

constexpr double kCornerRadius_m = 5.2;
constexpr double kTransition_m = 3.0;
constexpr double kHalfPi = 1.57079632679489661923;
// As far beside the loop as the lanes allow.
constexpr double kBeside_m = 1.9;

// Counter-clockwise around both double rows, starting in the middle of the southern lane, shifted outwards.
DrivePath loopPath(double outwards_m, bool clockwise) {
  const double x = 26.0 + outwards_m;
  const double y = 15.0 + outwards_m;
  std::vector<Eigen::Vector2d> corners = {{x, -y}, {x, y}, {-x, y}, {-x, -y}};
  if (clockwise) {
    std::reverse(corners.begin(), corners.end());
  }
  return DrivePath::throughWaypoints(corners, true, kCornerRadius_m, kTransition_m);
}

// Past a bay on the northern side of the southern lane, then backwards into it. It is free in the scene of
// seed 1 on day 0.
DrivePath reversePath() {
  constexpr double kBay_m = -9.1;    // x
  constexpr double kLane_m = -15.8;  // y
  constexpr double kRadius_m = 5.0;
  constexpr double kTurnIn_m = 1.0;
  constexpr double kTangent_m = 5.5;  // of the curve with its transitions
  constexpr double kApproach_m = 12.0;
  const double k = 1.0 / kRadius_m;
  return DrivePath(RigidTransform::planar(kBay_m + kTangent_m - kApproach_m, kLane_m, 0.0),
                   {{kApproach_m, 0.0, 0.0},
                    {kTurnIn_m, 0.0, k, true},
                    {kHalfPi * kRadius_m - kTurnIn_m, k, k, true},
                    {kTurnIn_m, k, 0.0, true},
                    {1.5, 0.0, 0.0, true}});
}

DrivePath stopAndGoPath() {
  DrivePath path(RigidTransform::planar(-19.0, -0.3, 0.02), {{38.0, 0.0, 0.0}});
  for (const double at_m : {5.0, 11.0, 14.0, 23.0, 31.0}) {
    path.addStop({at_m, 1.5});
  }
  return path;
}

DrivePath figureEightPath() {
  // Around the northern double row to the left, then around the southern one to the right.
  return DrivePath::throughWaypoints({{-12.0, 0.0},
                                      {26.0, 0.0},
                                      {26.0, 15.0},
                                      {-26.0, 15.0},
                                      {-26.0, 0.0},
                                      {26.0, 0.0},
                                      {26.0, -15.0},
                                      {-26.0, -15.0},
                                      {-26.0, 0.0},
                                      {-8.0, 0.0}},
                                     false, kCornerRadius_m, kTransition_m);
}

}  // namespace

std::vector<CatalogueEntry> listLotDrives() {
  return {
      {"short", "5 s of gentle curves in the middle lane"},
      {"loop", "around all rows of bays, back to the start"},
      {"figure_eight", "around the northern rows to the left, then around the southern ones to the right"},
      {"loop_reverse_direction", "the loop, clockwise"},
      {"other_day", "the loop in other light, with moved cars"},
      {"other_day_beside", "the same 2 m beside"},
      {"other_day_reverse_direction", "the same 2 m beside, clockwise"},
      {"stop_and_go", "along the middle lane with five stops"},
      {"reverse_into_bay", "past a bay, then backwards into it"},
      {"straight", "46 m straight on at 4 m/s"},
      {"standing", "20 s without moving"},
      {"approach", "straight at the plants that border the lot"}};
}

DrivePlan planLotDrive(const std::string& name) {
  VehicleMotionOptions motion;
  motion.duration_s = 600.0;
  const bool is_other_day = name.rfind("other_day", 0) == 0;
  if (name.rfind("loop", 0) == 0 || is_other_day) {
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    const bool clockwise = name.find("reverse_direction") != std::string::npos;
    const bool beside = is_other_day && name != "other_day";
    return {name, loopPath(beside ? kBeside_m : 0.0, clockwise), motion, is_other_day ? 1 : 0};
  }
  if (name == "stop_and_go" || name == "reverse_into_bay") {
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    motion.cruise_speed_m_per_s = name == "stop_and_go" ? 2.5 : 1.2;
    return {name, name == "stop_and_go" ? stopAndGoPath() : reversePath(), motion, 0};
  }
  if (name == "straight") {
    motion.cruise_speed_m_per_s = 4.0;
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    return {name, DrivePath(RigidTransform::planar(-22.0, -15.0, 0.0), {{46.0, 0.0, 0.0}}), motion, 0};
  }
  if (name == "standing") {
    motion.standstill_s = motion.duration_s = 20.0;
    return {name, DrivePath(RigidTransform::planar(-5.0, 0.2, 0.1), {{1.0, 0.0, 0.0}}), motion, 0};
  }
  if (name == "figure_eight") {
    return {name, figureEightPath(), motion, 0};
  }
  if (name == "short") {
    motion.duration_s = 5.0;
    const double k = 1.0 / 22.0;
    return {name,
            DrivePath(RigidTransform::planar(-7.0, -0.6, 0.06),
                      {{3.0, 0.0, -k}, {3.0, -k, 0.0}, {3.0, 0.0, k}, {3.0, k, 0.0}, {3.0, 0.0, -k}}),
            motion, 0};
  }
  if (name == "approach") {
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    // Straight at the bushes and trees that border the lot in the west.
    return {name, DrivePath(RigidTransform::planar(-8.0, 0.0, 3.14159265358979323846), {{15.0, 0.0, 0.0}}),
            motion, 0};
  }
  throw std::invalid_argument("drive: the lot has none of the name '" + name + "'");
}

}  // namespace vcharge
