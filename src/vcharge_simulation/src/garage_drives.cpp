#include <algorithm>
#include <stdexcept>

#include "garage_scene.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kCornerRadius_m = 5.0;
constexpr double kTransition_m = 3.0;

// Around all rows counter-clockwise, shifted outwards by `outwards_m` along the long lanes.
std::vector<Eigen::Vector2d> loopCorners(double outwards_m) {
  const double x = 26.0 + 0.3 * outwards_m;
  const double y = 15.5 + outwards_m;
  return {{x, -y}, {x, y}, {-x, y}, {-x, -y}};
}

DrivePath loopPath(double outwards_m, bool clockwise) {
  std::vector<Eigen::Vector2d> corners = loopCorners(outwards_m);
  if (clockwise) {
    std::reverse(corners.begin(), corners.end());
  }
  return DrivePath::throughWaypoints(corners, true, kCornerRadius_m, kTransition_m);
}

}  // namespace

std::vector<CatalogueEntry> listGarageDrives() {
  return {
      {"loop", "around all rows of bays, back to the start"},
      {"loop_reverse_direction", "the loop, clockwise"},
      {"other_day", "the loop 2 m beside on another day, with moved cars and other lamps"},
      {"figure_eight", "around the northern rows to the left, then around the southern ones to the right"},
      {"short", "5 s of gentle curves in the middle lane"}};
}

DrivePlan planGarageDrive(const std::string& name) {
  VehicleMotionOptions motion;
  motion.duration_s = 600.0;
  motion.standstill_s = 0.5;
  motion.stop_at_end = true;
  if (name == "loop" || name == "loop_reverse_direction") {
    return {name, loopPath(0.8, name != "loop"), motion, 0};
  }
  if (name == "other_day") {
    return {name, loopPath(-1.2, false), motion, 1};
  }
  if (name == "figure_eight") {
    motion.standstill_s = 0.0;
    return {name,
            DrivePath::throughWaypoints({{-12.0, 0.0},
                                         {26.0, 0.0},
                                         {26.0, 15.5},
                                         {-26.0, 15.5},
                                         {-26.0, 0.0},
                                         {26.0, 0.0},
                                         {26.0, -15.5},
                                         {-26.0, -15.5},
                                         {-26.0, 0.0},
                                         {-8.0, 0.0}},
                                        false, kCornerRadius_m, kTransition_m),
            motion, 0};
  }
  if (name == "short") {
    motion.standstill_s = 0.0;
    motion.stop_at_end = false;
    motion.duration_s = 5.0;
    const double k = 1.0 / 22.0;
    return {name,
            DrivePath(RigidTransform::planar(7.0, 0.6, kPi + 0.06),
                      {{3.0, 0.0, -k}, {3.0, -k, 0.0}, {3.0, 0.0, k}, {3.0, k, 0.0}, {3.0, 0.0, -k}}),
            motion, 0};
  }
  throw std::invalid_argument("drive: the garage has none of the name '" + name + "'");
}

}  // namespace vcharge
