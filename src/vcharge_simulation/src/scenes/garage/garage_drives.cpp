#include <stdexcept>

#include "scenes/garage/garage_scene.h"
#include "scenes/lane_paths.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr Lanes kLanes{26.0, 15.5, 5.0};

// Offsets from the loop: in the long lanes, mapping drives and drives of the other day are 2 m apart.
const Eigen::Vector2d kMapped_m(0.24, 0.8);
const Eigen::Vector2d kOtherDay_m(-0.36, -1.2);

}  // namespace

std::vector<CatalogueEntry> listGarageDrives() {
  return {
      {"loop", "around all rows of bays, back to the start"},
      {"loop_reverse_direction", "the loop, clockwise"},
      {"both_directions", "175 s through all lanes in both directions, to build maps from"},
      {"other_day", "the loop 2 m beside on another day, with moved cars and other lamps"},
      {"other_day_reverse_direction", "the same, clockwise"},
      {"figure_eight", "around the northern rows to the left, then around the southern ones to the right"},
      {"short", "5 s of gentle curves in the middle lane"}};
}

DrivePlan planGarageDrive(const std::string& name) {
  VehicleMotionOptions motion;
  motion.duration_s = 600.0;
  motion.standstill_s = 0.5;
  motion.stop_at_end = true;
  if (name == "loop" || name == "loop_reverse_direction") {
    return {name, kLanes.loop(kMapped_m, name != "loop"), motion, 0};
  }
  if (name == "other_day" || name == "other_day_reverse_direction") {
    return {name, kLanes.loop(kOtherDay_m, name != "other_day"), motion, 1};
  }
  if (name == "both_directions") {
    return {name, kLanes.bothDirections(kMapped_m), motion, 0};
  }
  if (name == "figure_eight") {
    motion.standstill_s = 0.0;
    return {name, kLanes.figureEight(), motion, 0};
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
