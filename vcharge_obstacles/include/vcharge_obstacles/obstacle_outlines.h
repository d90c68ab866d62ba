#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/dense_maps/obstacle_map.h"

namespace vcharge {

/// A connected group of occupied cells.
struct ObstacleOutline {
  std::vector<Eigen::Vector2d> corners_m;  ///< closed polygon around its cells, in the map's fixed frame
  double height_m = 0.0;                   ///< height of the highest cell
};

/// Outlines of all groups of occupied cells that touch at a side or a corner.
std::vector<ObstacleOutline> findOutlines(const ObstacleMap& map);

}  // namespace vcharge
