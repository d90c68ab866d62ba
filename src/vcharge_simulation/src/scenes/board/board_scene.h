#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// The lot with a calibration board (options.board) that is held before one camera of the standing car after
/// the other, at many places out to the rim of the image. The places suit options.rig; the mover's pose is
/// that of the board's pattern (BoardPattern).
std::shared_ptr<const Scene> buildBoardScene(const SceneOptions& options);
std::vector<CatalogueEntry> listBoardDrives();
/// std::invalid_argument for a name that listBoardDrives() does not have.
DrivePlan planBoardDrive(const std::string& name);

}  // namespace vcharge
