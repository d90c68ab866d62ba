#pragma once

#include "scenes/garage/garage_layout.h"
#include "scenes/scene_parts.h"

namespace vcharge {

/// Adds wheel stops in the bays, boards over the lanes, cable trays under the beams and down pipes at some
/// pillars. Everything that hangs is above `overhead_m`.
void addGarageFittings(const GarageLayout& layout, double overhead_m, SceneParts* parts);

}  // namespace vcharge
