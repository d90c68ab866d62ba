#pragma once

#include <string>

#include "vcharge_dense/height_mapper.h"

namespace vcharge {

/// Writes a folder atomically: height_map.{tiff,yaml} with confidence and gray levels, drivable.{pgm,yaml}
/// for map_server, mesh.ply, octomap.bt and height_map.png. Throws InputError that names a file that cannot
/// be written.
void writeHeightMapFolder(HeightMapResult* result, const std::string& folder);

}  // namespace vcharge
