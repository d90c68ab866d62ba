#include <utility>

#include "scenes/garage/garage_layout.h"
#include "scenes/lane_paths.h"
#include "scenes/scene_builders.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Offsets from the loop: in the long lanes, mapping drives and drives of the other day are 2 m apart.
const Eigen::Vector2d kMapped_m(0.24, 0.8);
// In the eastern lane a row of pillars stands nearer to the middle.
const Eigen::Vector2d kOtherDay_m(0.84, -1.2);

std::function<DrivePlan()> loop(const GaragePlan& plan, const Eigen::Vector2d& outwards_m, bool clockwise,
                                int day) {
  return [=] { return DrivePlan{"", plan.lanes.loop(outwards_m, clockwise), fromRestToRest(), day}; };
}

DrivePlan figureEight(const GaragePlan& plan) {
  VehicleMotionOptions motion = fromRestToRest();
  motion.standstill_s = 0.0;
  return {"", plan.lanes.figureEight(), motion};
}

DrivePlan shortDrive() {
  VehicleMotionOptions motion;
  motion.duration_s = 5.0;
  return {"", gentleCurves(RigidTransform::planar(7.0, 0.6, kPi + 0.06)), motion};
}

}  // namespace

std::vector<SceneDrive> garageDrives(uint64_t layout_seed) {
  const GaragePlan plan = GaragePlan::fromSeed(layout_seed);
  std::vector<SceneDrive> drives = {
      {{"loop", "around all rows of bays, back to the start"}, loop(plan, kMapped_m, false, 0)},
      {{"loop_reverse_direction", "the loop, clockwise"}, loop(plan, kMapped_m, true, 0)},
      {{"both_directions", "175 s through all lanes in both directions, for mapping"},
       [plan] {
         return DrivePlan{"", plan.lanes.bothDirections(kMapped_m), fromRestToRest()};
       }},
      {{"other_day", "2 m beside the loop on another day, with moved cars and other lamps"},
       loop(plan, kOtherDay_m, false, 1)},
      {{"other_day_reverse_direction", "other_day, clockwise"}, loop(plan, kOtherDay_m, true, 1)},
      {{"figure_eight",
        "counter-clockwise around the northern rows, then clockwise around the southern ones"},
       [plan] { return figureEight(plan); }},
      {{"bay_backwards", "backwards into a bay and out of it forwards"},
       [plan] {
         return DrivePlan{"", visitBayBackwards(plan.free_bay_x_m, -plan.lanes.y_m - 0.5),
                          fromRestToRest(2.0)};
       }},
      {{"bay_forwards", "forwards into the space beside the last bay of a row and out of it backwards"},
       [plan] {
         return DrivePlan{"", visitSpaceForwards(plan.lanes.x_m + 1.5, 1.2 - plan.lanes.y_m, 5.5),
                          fromRestToRest(2.0)};
       }},
      {{"three_point_turn", "a turn in three moves at the mouth of the middle lane"},
       [plan] {
         return DrivePlan{"",
                          threePointTurn({plan.lanes.x_m + 0.6, plan.lanes.y_m, plan.lanes.corner_radius_m}),
                          fromRestToRest(2.0)};
       }},
      {{"short", "5 s of gentle curves in the middle lane"}, shortDrive}};
  for (SceneDrive& drive : middleLaneDrives()) {
    drives.push_back(std::move(drive));
  }
  return drives;
}

}  // namespace vcharge
