#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// How the parking lot is built. The defaults are those of the scene "lot".
struct LotOptions {
  uint64_t seed = 1;               ///< of everything that stays from day to day
  int day = 0;                     ///< another day: other light, other clouds, and moved cars
  double moved_cars = 0.3;         ///< share of the parked cars that differ from day 0
  double ground_texel_m = 0.0125;  ///< of the ground's texture
  double light_texel_m = 0.05;     ///< of the baked shadows
  double foliage_density = 1.0;    ///< leaves over the default number
  void validate() const;           ///< throws std::invalid_argument naming the field
};

/// Builds an outdoor parking lot of 80 x 60 m: lanes of asphalt and cobbles around two double rows of bays,
/// parked cars, trees, hedges, kerbs, posts and fences, with houses around it. The same options give the same
/// scene.
std::shared_ptr<const Scene> buildLotScene(const LotOptions& options);

/// Drives in the lot: loops, short drives and manoeuvres.
std::vector<CatalogueEntry> listLotDrives();
/// Throws std::invalid_argument for a name that is not in listLotDrives().
DrivePlan planLotDrive(const std::string& name);

}  // namespace vcharge
