#include <utility>

#include "scenes/lane_paths.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/scene_builders.h"

namespace vcharge {

namespace {

// Offsets outwards from the loop in the middle of the lanes: mapping drives and drives of the other day are 2
// m apart, as far as parked cars allow.
const Eigen::Vector2d kMapped_m(-0.3, -1.1);
const Eigen::Vector2d kOtherDay_m(0.9, 0.9);

std::function<DrivePlan()> loop(const LotPlan& plan, const Eigen::Vector2d& outwards_m, bool clockwise,
                                int day) {
  return [=] {
    return DrivePlan{"", plan.lanes.loop(plan.drive_offset * outwards_m, clockwise), fromRestToRest(), day};
  };
}

std::function<DrivePlan()> straight(const RigidTransform& world_from_start, double length_m,
                                    double cruise_speed_m_per_s) {
  return [=] {
    return DrivePlan{"", DrivePath(world_from_start, {{length_m, 0.0, 0.0}}),
                     fromRestToRest(cruise_speed_m_per_s)};
  };
}

DrivePlan moving(const DrivePath& path, double duration_s) {
  VehicleMotionOptions motion;
  motion.duration_s = duration_s;
  return {"", path, motion};
}

}  // namespace

std::vector<SceneDrive> lotDrives(uint64_t layout_seed) {
  const LotPlan plan = LotPlan::fromSeed(layout_seed);
  const Eigen::Vector2d middle_m(0.0, 0.0);
  std::vector<SceneDrive> drives = {
      {{"short", "5 s of gentle curves in the middle lane"},
       [plan] {
         return moving(gentleCurves(RigidTransform::planar(-7.0, -0.6 * plan.drive_offset, 0.06)), 5.0);
       }},
      {{"loop", "around all rows of bays, back to the start"}, loop(plan, middle_m, false, 0)},
      {{"figure_eight",
        "counter-clockwise around the northern rows, then clockwise around the southern ones"},
       [plan] { return moving(plan.lanes.figureEight(), 600.0); }},
      {{"loop_reverse_direction", "the loop, clockwise"}, loop(plan, middle_m, true, 0)},
      {{"both_directions", "175 s through all lanes in both directions, for mapping"},
       [plan] {
         return DrivePlan{"", plan.lanes.bothDirections(plan.drive_offset * kMapped_m), fromRestToRest()};
       }},
      {{"other_day", "the loop in other light, with moved cars"}, loop(plan, middle_m, false, 1)},
      {{"other_day_beside", "other_day, 2 m beside both_directions"}, loop(plan, kOtherDay_m, false, 1)},
      {{"other_day_reverse_direction", "other_day_beside, clockwise"}, loop(plan, kOtherDay_m, true, 1)},
      {{"reverse_into_bay", "past a bay, then backwards into it"},
       [plan] {
         return DrivePlan{"", reverseIntoBay(plan.free_bay_x_m, -plan.lanes.y_m - 0.8, 12.0),
                          fromRestToRest(1.2)};
       }},
      {{"bay_backwards", "backwards into a bay and out of it forwards"},
       [plan] {
         return DrivePlan{"", visitBayBackwards(plan.free_bay_x_m, -plan.lanes.y_m - 0.8),
                          fromRestToRest(2.0)};
       }},
      {{"bay_forwards", "forwards into the space beside the last bay of a row and out of it backwards"},
       [plan] {
         return DrivePlan{"", visitSpaceForwards(plan.lanes.x_m, 1.3 - plan.lanes.y_m, 5.5),
                          fromRestToRest(2.0)};
       }},
      {{"three_point_turn", "a turn in three moves at the mouth of the middle lane"},
       [plan] {
         return DrivePlan{"", threePointTurn(plan.lanes), fromRestToRest(2.0)};
       }},
      {{"straight", "46 m straight ahead at 4 m/s"},
       straight(RigidTransform::planar(4.0 - plan.lanes.x_m, -plan.lanes.y_m, 0.0),
                2.0 * plan.lanes.x_m - 6.0, 4.0)},
      {{"approach", "straight towards the plants at the western border"},
       straight(RigidTransform::planar(18.0 - plan.lanes.x_m, 0.0, 3.14159265358979323846), 15.0, 2.5)}};
  for (SceneDrive& drive : middleLaneDrives()) {
    drives.push_back(std::move(drive));
  }
  return drives;
}

}  // namespace vcharge
