#pragma once

#include <vector>

#include "scenes/movers/own_car.h"
#include "scenes/movers/planned_mover.h"
#include "scenes/movers/ways/mover_routes.h"
#include "vcharge_simulation/scenes/mover_options.h"

namespace vcharge {

/// Plans all movers of a drive, one after the other: each keeps clear of the scene's obstacles and movers, of
/// those planned before it and of the own car. `start_s` is the scene time at the start of the drive. The
/// same arguments give the same movers.
std::vector<PlannedMover> planMovers(const MoverOptions& options, const MoverArea& area, const Scene& scene,
                                     const OwnCar& own_car, double start_s);

}  // namespace vcharge
