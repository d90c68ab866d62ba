#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// The lot with a course of small obstacles in its middle lane and two people, one of them walking.
std::shared_ptr<const Scene> buildCourseScene(const SceneOptions& options);
std::vector<CatalogueEntry> listCourseDrives();
/// std::invalid_argument for a name that listCourseDrives() does not have.
DrivePlan planCourseDrive(const std::string& name);

}  // namespace vcharge
