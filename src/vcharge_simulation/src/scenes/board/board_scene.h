#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// The lot with a calibration board (options.board) held in front of each camera of the standing car in turn,
/// at many poses out to the rim of the image. The poses fit the cameras of options.rig; the mover's pose is
/// that of the pattern frame (see BoardPattern).
std::shared_ptr<const Scene> buildBoardScene(const SceneOptions& options);
std::vector<CatalogueEntry> listBoardDrives();
/// Throws std::invalid_argument for a name that is not in listBoardDrives().
DrivePlan planBoardDrive(const std::string& name);

}  // namespace vcharge
