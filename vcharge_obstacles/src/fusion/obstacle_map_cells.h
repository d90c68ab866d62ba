#pragma once

#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>

#include "vcharge_core/dense_maps/obstacle_map.h"

namespace vcharge {

/// State of a map's cell at a point in the map's fixed frame.
inline int8_t stateIn(const ObstacleMap& map, double x_m, double y_m) {
  const Eigen::Vector2d cell = (Eigen::Vector2d(x_m, y_m) - map.origin_m) / map.cell_size_m;
  return map.state.at<int8_t>(static_cast<int>(std::floor(cell.y())), static_cast<int>(std::floor(cell.x())));
}

/// A map of free cells of 0.1 m, as many along both sides, with the fixed frame's origin in its middle.
inline ObstacleMap makeFreeMap(int num_cells) {
  ObstacleMap map = ObstacleMap::unobserved({num_cells, num_cells}, 0.1);
  map.origin_m.setConstant(-0.05 * num_cells);
  map.state.setTo(kCellFree);
  return map;
}

inline int countCells(const ObstacleMap& map, int8_t state) {
  return cv::countNonZero(map.state == state);
}

}  // namespace vcharge
