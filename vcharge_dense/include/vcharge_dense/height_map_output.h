#pragma once

#include <string>

#include "vcharge_dense/height_mapper.h"

namespace vcharge {

/// Writes a folder that appears as a whole or not at all: height_map.{tiff,yaml} with confidence and gray,
/// drivable.{pgm,yaml} (map_server), mesh.ply, octomap.bt, height_map.png and drivable.png. InputError naming
/// the file that cannot be written.
void writeHeightMapFolder(HeightMapResult* result, const std::string& folder);

}  // namespace vcharge
