#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scene_catalogue.h"

namespace vcharge {

/// The lot with a chessboard of 10 x 7 squares that is held before one camera of the standing Golf after the
/// other, at many places out to the rim of the image. The board's frame has its origin in the first inner
/// corner, x along the 9 inner corners, y along the 6, and z away from the viewer.
std::shared_ptr<const Scene> buildBoardScene(const SceneOptions& options);
std::vector<CatalogueEntry> listBoardDrives();
/// std::invalid_argument for a name that listBoardDrives() does not have.
DrivePlan planBoardDrive(const std::string& name);

}  // namespace vcharge
