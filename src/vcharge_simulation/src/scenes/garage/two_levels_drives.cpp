#include <stdexcept>

#include "scenes/garage/two_levels_scene.h"
#include "scenes/lane_paths.h"
#include "scenes/lot/lot_layout.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kTransition_m = 3.0;
constexpr Lanes kLanes{26.5, 15.0, 5.2};
constexpr double kBeside_m = 1.0;  // to either side in the long lanes

// Once around, backwards into a bay, out of it the other way and around in that direction: in this scene no
// lane connects the two directions.
DrivePath bothDirectionsPath() {
  constexpr double kCurve_m = 5.5;  // from the bay to where the car leaves the lane and enters it again
  const double x = kLanes.x_m;
  const double y = kLanes.y_m + kBeside_m;
  const auto through = [](const std::vector<Eigen::Vector2d>& waypoints) {
    return DrivePath::throughWaypoints(waypoints, false, kLanes.corner_radius_m, kTransition_m);
  };
  DrivePath path = through({{0.0, -y}, {x, -y}, {x, y}, {-x, y}, {-x, -y}, {kFreeBayX_m + kCurve_m, -y}});
  path.append(reverseIntoBay(kFreeBayX_m, -y, 0.0));
  path.append(leaveBayWestwards(kFreeBayX_m, -y, 0.0));
  path.append(through({{kFreeBayX_m - kCurve_m, -y}, {-x, -y}, {-x, y}, {x, y}, {x, -y}, {0.0, -y}}));
  return path;
}

}  // namespace

std::vector<CatalogueEntry> listTwoLevelsDrives() {
  return {{"loop", "up the eastern ramp, along the upper level, down the western ramp, back to the start"},
          {"loop_reverse_direction", "the loop, clockwise"},
          {"both_directions", "the loop, a turn in a bay, and the loop clockwise, to build maps from"},
          {"up_and_down", "up the eastern ramp, a stop, and down again backwards"},
          {"other_day", "the loop 2 m beside on another day"},
          {"other_day_reverse_direction", "the same, clockwise"}};
}

DrivePlan planTwoLevelsDrive(const std::string& name) {
  VehicleMotionOptions motion;
  motion.duration_s = 600.0;
  motion.standstill_s = 0.5;
  motion.stop_at_end = true;
  DrivePlan plan{name, DrivePath(RigidTransform(), {}), motion, 0, twoLevelsGroundHeight};
  if (name == "up_and_down") {
    plan.path =
        DrivePath(RigidTransform::planar(26.0, -15.0, kHalfPi), {{30.0, 0.0, 0.0}, {30.0, 0.0, 0.0, true}});
    return plan;
  }
  if (name == "both_directions") {
    plan.path = bothDirectionsPath();
    return plan;
  }
  if (name == "loop" || name == "loop_reverse_direction") {
    plan.path = kLanes.loop({0.0, kBeside_m}, name != "loop");
    return plan;
  }
  if (name == "other_day" || name == "other_day_reverse_direction") {
    plan.path = kLanes.loop({0.0, -kBeside_m}, name != "other_day");
    plan.day = 1;
    return plan;
  }
  throw std::invalid_argument("drive: the lot on two levels has none of the name '" + name + "'");
}

}  // namespace vcharge
