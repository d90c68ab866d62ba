#pragma once

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

/// Cells of a map in an area, whose corners are in the map's fixed frame.
inline AreaCells cellsOf(const ObstacleMap& map, Quadrangle corners_m) {
  for (Eigen::Vector2d& corner : corners_m) {
    corner = (corner - map.origin_m) / map.cell_size_m - Eigen::Vector2d(0.5, 0.5);
  }
  return cellsOf(corners_m, map.state.size());
}

}  // namespace vcharge
