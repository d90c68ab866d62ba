#pragma once

#include "vcharge_core/dense_maps/obstacle_map.h"

namespace vcharge {

/// Computes a scan from a map: the nearest obstacle in each of `num_rays` sectors around the vehicle frame's
/// origin, and the range up to which the sector's cells are free without a gap. Where the cells around the
/// first occupied one form a line, the range is that at which the line is nearest in the sector. Else it is
/// the mean of the cells within 0.2 m of the first; for obstacles as low as a kerb, of the first alone, as
/// the cells behind it are the kerb's top. A cell within half a cell of a sector's border counts in both
/// sectors.
ObstacleScan makeScan(const ObstacleMap& map, int num_rays);

}  // namespace vcharge
