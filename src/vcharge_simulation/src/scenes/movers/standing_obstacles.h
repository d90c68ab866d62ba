#pragma once

#include <vector>

#include "scenes/movers/footprint.h"
#include "scenes/movers/planned_mover.h"
#include "scenes/scene_things.h"

namespace vcharge {

/// All that stands in a scene, as obstacles to movers.
class StandingObstacles {
 public:
  /// `scene` must outlive this object; movers stay within `bounds`.
  StandingObstacles(const Scene& scene, const GroundRectangle& bounds);

  /// Length of the mover's path from `from_m` up to `to_m` that is free. A mover that starts on a raised area
  /// stays on it.
  double freeLength(double from_m, double to_m, const PlannedMover& mover) const;
  /// Height of the ground on which the mover starts.
  double groundUnder(const PlannedMover& mover) const;

 private:
  struct Standing {
    const Obstacle* obstacle;
    Footprint outline;
  };
  const Standing* raisedAreaUnder(const Footprint& outline) const;
  bool isFree(const Footprint& outline, const Standing* raised, double height_m) const;

  std::vector<Standing> standing_;
  const GroundRectangle bounds_;
};

}  // namespace vcharge
