#pragma once

#include "scenes/garage/garage_layout.h"
#include "scenes/scene_parts.h"

namespace vcharge {

/// What a garage has besides its walls: wheel stops in the bays, boards that hang over the lanes, cable trays
/// under the beams and down pipes at some pillars. All that hangs does so above `overhead_m`.
void addGarageFittings(const GarageLayout& layout, double overhead_m, SceneParts* parts);

}  // namespace vcharge
