#include <stdexcept>

#include "vcharge_simulation/lot_scene.h"

namespace vcharge {

namespace {

constexpr double kCornerRadius_m = 5.2;
constexpr double kTransition_m = 3.0;

DrivePath loopPath() {
  // Counter-clockwise around both double rows, starting on the eastern half of the southern lane.
  const DrivePath once = DrivePath::throughWaypoints(
      {{26.0, -15.0}, {26.0, 15.0}, {-26.0, 15.0}, {-26.0, -15.0}}, true, kCornerRadius_m, kTransition_m);
  return once;
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
      {"other_day", "the loop in other light, with moved cars"},
      {"approach", "straight at the plants that border the lot"}};
}

DrivePlan planLotDrive(const std::string& name) {
  VehicleMotionOptions motion;
  motion.duration_s = 600.0;
  if (name == "loop" || name == "other_day") {
    motion.standstill_s = 0.5;
    motion.stop_at_end = true;
    return {name, loopPath(), motion, name == "loop" ? 0 : 1};
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
