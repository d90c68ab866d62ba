#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/height_steps.h"
#include "obstacles/map_cells.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Reads a map at points of the world's frame.
class MapInWorld {
 public:
  MapInWorld(const HeightMap& map, const RigidTransform& world_from_map)
      : map_(map), world_from_map_(world_from_map), map_from_world_(world_from_map.inverse()) {}

  /// Interpolated height in the world at a point of the world; NaN if it is not mapped. `about_m`:
  /// approximate height of the surface, for tilted maps.
  double heightAt(const Eigen::Vector2d& point_m, double about_m) const {
    const Eigen::Vector3d in_map = inMap(point_m, about_m);
    const double height = interpolateHeight(map_, in_map.head<2>());
    return (world_from_map_ * Eigen::Vector3d(in_map.x(), in_map.y(), height)).z();
  }

  /// Like heightAt(), but the height of the nearest cell without interpolation.
  double cellHeightAt(const Eigen::Vector2d& point_m, double about_m) const {
    const Eigen::Vector3d in_map = inMap(point_m, about_m);
    const double height = nearestHeight(map_, in_map.head<2>());
    return (world_from_map_ * Eigen::Vector3d(in_map.x(), in_map.y(), height)).z();
  }

  /// Heights along a line over a step. Interpolation puts the edge of a low step halfway between two cells. A
  /// high step is read near the ground, which would be up to half a cell in front of the edge, so its cells
  /// are not interpolated.
  HeightAt heightsOver(const HeightStep& step) const {
    return [this, high = isHigh(step), about_m = step.low_m](const Eigen::Vector2d& point_m) {
      return high ? cellHeightAt(point_m, about_m) : heightAt(point_m, about_m);
    };
  }

  /// The cell at a point of the world, which may be outside the map.
  cv::Point cellAt(const Eigen::Vector2d& point_m, double about_m) const {
    return nearestCell(map_, inMap(point_m, about_m).head<2>());
  }

  /// The centre of a cell on the map's surface, or at ground_m if it is not observed.
  Eigen::Vector3d cell(int column, int row, double ground_m) const {
    const Eigen::Vector2d centre = map_.centreOf(column, row);
    const float height = map_.height_m.at<float>(row, column);
    return world_from_map_ *
           Eigen::Vector3d(centre.x(), centre.y(), std::isfinite(height) ? height : ground_m);
  }

 private:
  Eigen::Vector3d inMap(const Eigen::Vector2d& point_m, double about_m) const {
    return map_from_world_ * Eigen::Vector3d(point_m.x(), point_m.y(), about_m);
  }

  const HeightMap& map_;
  const RigidTransform world_from_map_, map_from_world_;
};

/// Lowest and highest true height within `reach_m` along rows and columns.
struct HeightExtent {
  float low = std::numeric_limits<float>::infinity(), high = -low;
};

inline HeightExtent extentAround(const HeightMap& truth, const Eigen::Vector2d& point_m, double reach_m) {
  const cv::Point cell = nearestCell(truth, point_m);
  const auto reach = static_cast<int>(std::ceil(reach_m / truth.cell_size_m));
  HeightExtent extent;
  for (int r = std::max(0, cell.y - reach); r <= std::min(truth.height_m.rows - 1, cell.y + reach); ++r) {
    for (int c = std::max(0, cell.x - reach); c <= std::min(truth.height_m.cols - 1, cell.x + reach); ++c) {
      extent.low = std::min(extent.low, truth.height_m.at<float>(r, c));
      extent.high = std::max(extent.high, truth.height_m.at<float>(r, c));
    }
  }
  return extent;
}

inline double spreadAround(const HeightMap& truth, const Eigen::Vector2d& point_m, double reach_m) {
  const HeightExtent extent = extentAround(truth, point_m, reach_m);
  return extent.high - extent.low;
}

}  // namespace vcharge
