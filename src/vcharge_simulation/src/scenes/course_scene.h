#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// The lot with small obstacles in its middle lane, a standing and a walking person.
std::shared_ptr<const Scene> buildCourseScene(const SceneOptions& options);
std::vector<CatalogueEntry> listCourseDrives();
/// Throws std::invalid_argument for a name that is not in listCourseDrives().
DrivePlan planCourseDrive(const std::string& name);

}  // namespace vcharge
