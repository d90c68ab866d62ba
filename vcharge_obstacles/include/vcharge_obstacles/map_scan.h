#pragma once

#include "vcharge_core/dense_maps/obstacle_map.h"

namespace vcharge {

/// The nearest obstacle of a map in each of `num_rays` sectors of the full circle around the vehicle frame's
/// origin, and how far all cells in the sector are free from the nearest free one on. A range is the mean of
/// the occupied cells from the first one to `depth_m` behind it, or of the first one alone where it is as low
/// as a kerb, whose top lies behind its edge; cells within half a cell of a sector's border speak for both
/// its sides.
ObstacleScan makeScan(const ObstacleMap& map, int num_rays, double depth_m);

}  // namespace vcharge
