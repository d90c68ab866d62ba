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

inline int countCells(const ObstacleMap& map, int8_t state) {
  return cv::countNonZero(map.state == state);
}

}  // namespace vcharge
