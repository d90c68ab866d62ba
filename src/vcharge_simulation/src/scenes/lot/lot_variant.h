#pragma once

#include <functional>
#include <memory>

#include "scenes/lot/lot_layout.h"
#include "vcharge_simulation/scenes/lot_scene.h"

namespace vcharge {

class SceneParts;

/// What another scene on the lot's ground changes about the lot.
struct LotVariant {
  LotLayout layout;
  std::function<void(SceneParts*)> add_things;  ///< last of all, before light is baked; may be null
  /// Replaces the level ground of kLotArea, given its material; may be null.
  std::function<void(uint32_t, SceneParts*)> add_ground;
  GroundHeight ground_height;  ///< of the ground without islands; null: level
};

std::shared_ptr<const Scene> buildLotVariant(const LotOptions& options, const LotVariant& variant);
LotOptions lotOptionsOf(const SceneOptions& options);

}  // namespace vcharge
