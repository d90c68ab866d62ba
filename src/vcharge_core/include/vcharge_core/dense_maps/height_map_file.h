#pragma once

#include <string>

#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// Writes STEM.tiff (heights) and, if the map has them, STEM_confidence.tiff, STEM_gray.png and
/// STEM_solid.png; STEM.yaml (file, frame, origin_m, cell_size_m, size_cells, confidence_file, gray_file,
/// solid_file, content_hash) comes last, so a map whose YAML exists is complete. Throws InputError naming the
/// file that cannot be written.
void writeHeightMap(const HeightMap& map, const std::string& path_stem);

/// Reads the output of writeHeightMap() or the true height map of a simulated drive. `path` is the YAML file,
/// or a folder that contains height_map.yaml. Throws InputError naming the file and the key.
HeightMap readHeightMap(const std::string& path);

/// Writes STEM.pgm and STEM.yaml in the format of map_server: 254 free (drivable), 0 occupied (obstacle), 205
/// unknown; the first image row is the map's last row (largest y). `states` is CV_8UC1 of CellState.
void writeOccupancyMap(const HeightMap& map, const cv::Mat& states, const std::string& path_stem);

/// Writes a binary PLY mesh: a vertex with gray level (white if unknown) at the centre of each observed cell,
/// and two triangles between four observed neighbours; normals point up.
void writeHeightMapMesh(const HeightMap& map, const std::string& path);

/// Colours heights from `low_m` (blue) to `high_m` (red), shaded by slope, north up; black where not
/// observed. CV_8UC3 (BGR).
cv::Mat colourHeight(const HeightMap& map, double low_m, double high_m);

}  // namespace vcharge
