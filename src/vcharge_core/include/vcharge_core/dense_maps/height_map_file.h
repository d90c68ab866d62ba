#pragma once

#include <string>

#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// Writes STEM.tiff (heights), STEM_confidence.tiff, STEM_gray.png and STEM_solid.png where the map has them,
/// then STEM.yaml (file, frame, origin_m, cell_size_m, size_cells, confidence_file, gray_file, solid_file,
/// content_hash), so that a map whose YAML exists is complete. InputError naming the file that cannot be
/// written.
void writeHeightMap(const HeightMap& map, const std::string& path_stem);

/// Reads what writeHeightMap() wrote, or a simulated drive's truth. `path` is the YAML file, or a folder
/// with a height_map.yaml. InputError naming file and key.
HeightMap readHeightMap(const std::string& path);

/// Writes STEM.pgm and STEM.yaml as map_server's users expect them: 254 free (drivable), 0 occupied
/// (obstacle), 205 unknown; the first row of the picture is the map's last (largest y). `states` is CV_8UC1
/// of CellState.
void writeOccupancyMap(const HeightMap& map, const cv::Mat& states, const std::string& path_stem);

/// Writes a binary PLY: a vertex with gray (or white) at the centre of each observed cell, and two triangles
/// between four observed neighbours; normals point up.
void writeHeightMapMesh(const HeightMap& map, const std::string& path);

/// Colours by height from `low_m` (blue) to `high_m` (red), north up, shaded by the slope; black where not
/// observed. CV_8UC3 (BGR).
cv::Mat colourHeight(const HeightMap& map, double low_m, double high_m);

}  // namespace vcharge
