#pragma once

#include "scenes/movers/ways/mover_routes.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

class SceneParts;

/// Adds the movers of `options` to a finished scene, which must be the one of `parts`: they are not part of
/// the baked light.
void addMovers(const SceneOptions& options, const MoverArea& area, SceneParts* parts);

}  // namespace vcharge
