#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// The lot with its northern half raised behind a wall, ramps of 6 degrees in the east and in the west, and
/// slightly uneven ground.
std::shared_ptr<const Scene> buildTwoLevelsScene(const SceneOptions& options);
/// Height of the drivable ground: levels, ramps and bumps.
double twoLevelsGroundHeight(double x_m, double y_m);

std::vector<CatalogueEntry> listTwoLevelsDrives();
/// Throws std::invalid_argument for a name that is not in listTwoLevelsDrives().
DrivePlan planTwoLevelsDrive(const std::string& name);

}  // namespace vcharge
