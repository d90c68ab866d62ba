#pragma once

#include <functional>
#include <memory>

#include "scenes/lot/lot_layout.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

class SceneParts;

/// Changes that other scenes on the lot's ground make to the lot.
struct LotVariant {
  LotLayout layout;
  std::function<void(SceneParts*)> add_things;  ///< called last, before light is baked; may be null
  /// Replaces the level ground of kLotArea; receives its material; may be null.
  std::function<void(uint32_t, SceneParts*)> add_ground;
  GroundHeight ground_height;  ///< ground without islands; null: level at z = 0
};

std::shared_ptr<const Scene> buildLotVariant(const SceneOptions& options, const LotVariant& variant);

}  // namespace vcharge
