#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// The lot with its northern half on a higher level, behind a wall: ramps of 6 degrees lead up in the east
/// and in the west, and all of the ground is a little uneven.
std::shared_ptr<const Scene> buildTwoLevelsScene(const SceneOptions& options);
/// Of the drivable ground: levels, ramps and bumps.
double twoLevelsGroundHeight(double x_m, double y_m);

std::vector<CatalogueEntry> listTwoLevelsDrives();
/// std::invalid_argument for a name that listTwoLevelsDrives() does not have.
DrivePlan planTwoLevelsDrive(const std::string& name);

}  // namespace vcharge
