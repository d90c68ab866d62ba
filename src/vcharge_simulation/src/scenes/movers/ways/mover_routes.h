#pragma once

#include <optional>
#include <vector>

#include "scenes/lane_paths.h"
#include "scenes/lot/parking_bays.h"
#include "scenes/movers/ways/mover_path.h"
#include "scenes/scene_things.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

/// Where movers may be; what stands there are the scene's obstacles.
struct MoverArea {
  GroundRectangle bounds;
  Lanes lanes;
  std::vector<PlannedBay> bays;
  bool is_road = false;  ///< the only lane is along y = 0 and not closed
};

/// A way back and forth between two points, with a turn in a small half circle at each end.
DrivePath walkBackAndForth(const RigidTransform& world_from_start, double leg_m, double turn_radius_m,
                           double total_m);

/// A drive around one or both blocks of bays, or along the road, on the right-hand side: `aside_m` from the
/// middle of the lanes.
DrivePath driveAround(const MoverArea& area, double aside_m, double total_m, Random* random);

/// A drive forwards out of a bay and on along the lanes; `axle_m` is the distance of the rear axle from the
/// middle of the car. Nothing if the bay is too near to a corner.
std::optional<DrivePath> leaveBay(const MoverArea& area, const PlannedBay& bay, double axle_m, double aside_m,
                                  bool to_left);

}  // namespace vcharge
