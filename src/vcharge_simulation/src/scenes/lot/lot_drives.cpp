#include "scenes/lane_paths.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/scene_builders.h"

namespace vcharge {

namespace {

// Offsets outwards from the loop in the middle of the lanes: mapping drives and drives of the other day are 2
// m apart, as far as parked cars allow.
const Eigen::Vector2d kMapped_m(-0.3, -1.1);
const Eigen::Vector2d kOtherDay_m(0.9, 0.9);

std::function<DrivePlan()> loop(const Eigen::Vector2d& outwards_m, bool clockwise, int day) {
  return [=] { return DrivePlan{"", Lanes().loop(outwards_m, clockwise), fromRestToRest(), day}; };
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

std::vector<SceneDrive> lotDrives() {
  const Eigen::Vector2d middle_m(0.0, 0.0);
  return {{{"short", "5 s of gentle curves in the middle lane"},
           [] { return moving(gentleCurves(RigidTransform::planar(-7.0, -0.6, 0.06)), 5.0); }},
          {{"loop", "around all rows of bays, back to the start"}, loop(middle_m, false, 0)},
          {{"figure_eight",
            "counter-clockwise around the northern rows, then clockwise around the southern ones"},
           [] { return moving(Lanes().figureEight(), 600.0); }},
          {{"loop_reverse_direction", "the loop, clockwise"}, loop(middle_m, true, 0)},
          {{"both_directions", "175 s through all lanes in both directions, for mapping"},
           [] {
             return DrivePlan{"", Lanes().bothDirections(kMapped_m), fromRestToRest()};
           }},
          {{"other_day", "the loop in other light, with moved cars"}, loop(middle_m, false, 1)},
          {{"other_day_beside", "other_day, 2 m beside both_directions"}, loop(kOtherDay_m, false, 1)},
          {{"other_day_reverse_direction", "other_day_beside, clockwise"}, loop(kOtherDay_m, true, 1)},
          {{"stop_and_go", "along the middle lane with five stops"},
           [] {
             return DrivePlan{"", stopAndGo(RigidTransform::planar(-19.0, -0.3, 0.02)), fromRestToRest()};
           }},
          {{"reverse_into_bay", "past a bay, then backwards into it"},
           [] {
             return DrivePlan{"", reverseIntoBay(kFreeBayX_m, -15.8, 12.0), fromRestToRest(1.2)};
           }},
          {{"bay_backwards", "backwards into a bay and out of it forwards"},
           [] {
             return DrivePlan{"", visitBayBackwards(kFreeBayX_m, -15.8), fromRestToRest(2.0)};
           }},
          {{"bay_forwards", "forwards into the space beside the last bay of a row and out of it backwards"},
           [] {
             return DrivePlan{"", visitSpaceForwards(26.0, -13.7, 5.5), fromRestToRest(2.0)};
           }},
          {{"three_point_turn", "a turn in three moves at the mouth of the middle lane"},
           [] {
             return DrivePlan{"", threePointTurn(Lanes()), fromRestToRest(2.0)};
           }},
          {{"straight", "46 m straight ahead at 4 m/s"},
           straight(RigidTransform::planar(-22.0, -15.0, 0.0), 46.0, 4.0)},
          {{"standing", "20 s at standstill"},
           [] {
             return DrivePlan{"", standingPath(RigidTransform::planar(-5.0, 0.2, 0.1)), standing(20.0)};
           }},
          {{"approach", "straight towards the plants at the western border"},
           straight(RigidTransform::planar(-8.0, 0.0, 3.14159265358979323846), 15.0, 2.5)}};
}

}  // namespace vcharge
