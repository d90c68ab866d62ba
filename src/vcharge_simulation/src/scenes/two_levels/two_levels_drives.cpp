#include "scenes/lane_paths.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/scene_builders.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kTransition_m = 3.0;
constexpr Lanes kLanes{26.5, 15.0, 5.2};
constexpr double kBeside_m = 1.0;  // to either side in the long lanes

// Once around the lot, backwards into a bay, out of it the other way and around in that direction, since no
// lane connects the two directions in this scene.
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

DrivePath upAndDownPath() {
  return DrivePath(RigidTransform::planar(26.0, -15.0, kHalfPi), {{30.0, 0.0, 0.0}, {30.0, 0.0, 0.0, true}});
}

DrivePlan onUnevenGround(const DrivePath& path, int day) {
  return {"", path, fromRestToRest(), day, twoLevelsGroundHeight};
}

std::function<DrivePlan()> loop(double outwards_m, bool clockwise, int day) {
  return [=] { return onUnevenGround(kLanes.loop({0.0, outwards_m}, clockwise), day); };
}

}  // namespace

std::vector<SceneDrive> twoLevelsDrives() {
  return {{{"loop", "up the eastern ramp, along the upper level, down the western ramp, back to the start"},
           loop(kBeside_m, false, 0)},
          {{"loop_reverse_direction", "the loop, clockwise"}, loop(kBeside_m, true, 0)},
          {{"both_directions", "the loop, a turn in a bay, and the loop clockwise, for mapping"},
           [] { return onUnevenGround(bothDirectionsPath(), 0); }},
          {{"up_and_down", "up the eastern ramp, a stop, and down again backwards"},
           [] { return onUnevenGround(upAndDownPath(), 0); }},
          {{"other_day", "2 m beside the loop on another day"}, loop(-kBeside_m, false, 1)},
          {{"other_day_reverse_direction", "other_day, clockwise"}, loop(-kBeside_m, true, 1)}};
}

}  // namespace vcharge
