#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/rendering/renderer.h"

namespace vcharge {

/// Heights of a scene on a regular grid, seen from above.
struct TruthHeightMap {
  cv::Mat height_m;  ///< CV_32FC1; row 0 is at origin_m.y, column 0 at origin_m.x; NaN where no ray meets a
                     ///< surface
  Eigen::Vector2d origin_m{0, 0};  ///< centre of the first cell, in the world frame
  double cell_size_m = 0.1;
};

/// Height of the highest surface at each cell centre, ignoring surfaces more than `max_height_m` above the
/// drivable ground (tree crowns, lamps); roofs of buildings always count.
TruthHeightMap computeHeightMap(const Renderer& renderer, double cell_size_m, double max_height_m);

/// Writes PATH_STEM.tiff (float) and PATH_STEM.yaml (origin_m, cell_size_m, size, file).
void writeHeightMap(const TruthHeightMap& map, const std::string& path_stem);
/// Writes the obstacles as a YAML list of kind, base_z_m, top_z_m and footprint_m.
void writeObstacles(const std::vector<Obstacle>& obstacles, const std::string& path);
/// Movers whose class is known, numbered from 1.
std::vector<TrackedObject> trueObjects(const std::vector<Mover>& movers, double time_s);
/// Writes every mover at every image: a YAML list of stamp_ns and, for each mover, name, kind, base_z_m,
/// top_z_m, footprint_m, class, translation_m and rotation_xyzw (world_from_mover), velocity_m_per_s,
/// height_m and is_standing. `times_s` is the scene time at each stamp.
void writeMovers(const std::vector<Mover>& movers, const std::vector<Timestamp>& stamps,
                 const std::vector<double>& times_s, const std::string& path);

}  // namespace vcharge
