#pragma once

#include <cmath>
#include <limits>

#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// The cell whose centre is nearest to a point in the map's frame; it may lie outside the map.
inline cv::Point nearestCell(const HeightMap& map, const Eigen::Vector2d& point_m) {
  const Eigen::Vector2d cell = (point_m - map.origin_m) / map.cell_size_m;
  return {static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y()))};
}

/// Height of the nearest cell; NaN outside the map.
inline double nearestHeight(const HeightMap& map, const Eigen::Vector2d& point_m) {
  const cv::Point at = nearestCell(map, point_m);
  return cv::Rect(cv::Point(), map.height_m.size()).contains(at) ? map.height_m.at<float>(at)
                                                                 : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace vcharge
