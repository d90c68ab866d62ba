#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

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

/// Builds an outdoor parking lot of 80 x 60 m: lanes of asphalt and cobbles around two double rows of bays,
/// parked cars, trees, hedges, kerbs, posts and fences, with houses around it.
std::shared_ptr<const Scene> buildLotScene(const SceneOptions& options);

/// Drives in the lot: loops, short drives and manoeuvres.
std::vector<CatalogueEntry> listLotDrives();
/// Throws std::invalid_argument for a name that is not in listLotDrives().
DrivePlan planLotDrive(const std::string& name);

}  // namespace vcharge
