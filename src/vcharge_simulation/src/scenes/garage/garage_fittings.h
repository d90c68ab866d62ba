#pragma once

#include "scenes/garage/garage_layout.h"
#include "scenes/scene_parts.h"

namespace vcharge {

/// Adds wheel stops in the bays, boards over the lanes, cable trays under the beams and down pipes at some
/// pillars. Everything that hangs is above the plan's overhead height.
void addGarageFittings(const GarageLayout& layout, SceneParts* parts);

}  // namespace vcharge
