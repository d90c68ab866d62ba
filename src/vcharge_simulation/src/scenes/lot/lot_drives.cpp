#include <stdexcept>

#include "scenes/lane_paths.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/lot/lot_scene.h"

namespace vcharge {

namespace {

// Offsets outwards from the loop in the middle of the lanes: mapping drives and drives of the other day are 2
// m apart, as far as parked cars allow.
const Eigen::Vector2d kMapped_m(-0.3, -1.1);
const Eigen::Vector2d kOtherDay_m(0.9, 0.9);

DrivePath stopAndGoPath() {
  DrivePath path(RigidTransform::planar(-19.0, -0.3, 0.02), {{38.0, 0.0, 0.0}});
  for (const double at_m : {5.0, 11.0, 14.0, 23.0, 31.0}) {
    path.addStop({at_m, 1.5});
  }
  return path;
}

}  // namespace

std::vector<CatalogueEntry> listLotDrives() {
  return {
      {"short", "5 s of gentle curves in the middle lane"},
      {"loop", "around all rows of bays, back to the start"},
      {"figure_eight", "around the northern rows to the left, then around the southern ones to the right"},
      {"loop_reverse_direction", "the loop, clockwise"},
      {"both_directions", "175 s through all lanes in both directions, to build maps from"},
      {"other_day", "the loop in other light, with moved cars"},
      {"other_day_beside", "the same 2 m beside both_directions"},
      {"other_day_reverse_direction", "the same, clockwise"},
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
    return {name, Lanes().loop(beside ? kOtherDay_m : Eigen::Vector2d(0.0, 0.0), clockwise), motion,
            is_other_day ? 1 : 0};
  }
  if (name == "both_directions") {
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    return {name, Lanes().bothDirections(kMapped_m), motion, 0};
  }
  if (name == "stop_and_go" || name == "reverse_into_bay") {
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    motion.cruise_speed_m_per_s = name == "stop_and_go" ? 2.5 : 1.2;
    return {name, name == "stop_and_go" ? stopAndGoPath() : reverseIntoBay(kFreeBayX_m, -15.8, 12.0), motion,
            0};
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
    return {name, Lanes().figureEight(), motion, 0};
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
    // Towards the bushes and trees at the western border.
    return {name, DrivePath(RigidTransform::planar(-8.0, 0.0, 3.14159265358979323846), {{15.0, 0.0, 0.0}}),
            motion, 0};
  }
  throw std::invalid_argument("drive: the lot has none of the name '" + name + "'");
}

}  // namespace vcharge
