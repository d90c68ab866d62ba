#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// An underground garage of 64 x 47 m, lit by lamps: lanes around rows of bays between numbered pillars,
/// parked cars, beams and pipes. The same options give the same scene.
std::shared_ptr<const Scene> buildGarageScene(const SceneOptions& options);
std::vector<CatalogueEntry> listGarageDrives();
/// Throws std::invalid_argument for a name that is not in listGarageDrives().
DrivePlan planGarageDrive(const std::string& name);

}  // namespace vcharge
