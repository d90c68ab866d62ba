#pragma once

#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

/// Finds marked parking bays in the gray levels of a height map, and whether they are free: bright lines on
/// the ground, grouped by a model of rows (one width, angle and length, ends on a line), so that lines that
/// parked cars hide are found from their neighbours. Bays are ordered by row and place in it.
///
/// InputError if the map has no gray levels or its cells are larger than 0.1 m: lines are 0.1 to 0.2 m wide.
ParkingBays findBays(const HeightMap& map);

}  // namespace vcharge
