#include "obstacles/judged_map.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge::internal {

JudgedMap::JudgedMap(const ObstacleMap& obstacle_map, const RigidTransform& world_from_vehicle)
    : map(obstacle_map),
      level(RigidTransform::planar(world_from_vehicle.translation().x(), world_from_vehicle.translation().y(),
                                   yawOfRotation(world_from_vehicle.rotation()))),
      world_from_fixed_(level * map.fixed_from_vehicle.inverse()) {
  forEachCell([&](int column, int row, int8_t state) {
    if (state == kCellOccupied) {
      occupied.push_back({worldOf(column, row), map.height_m.at<float>(row, column)});
    }
  });
}

Eigen::Vector2d JudgedMap::fixedOf(int column, int row) const {
  return map.origin_m + map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
}

Eigen::Vector2d JudgedMap::worldOf(int column, int row) const {
  const Eigen::Vector2d fixed = fixedOf(column, row);
  return (world_from_fixed_ * Eigen::Vector3d(fixed.x(), fixed.y(), 0.0)).head<2>();
}

bool JudgedMap::reports(const TruthObstacle& obstacle) const {
  return std::any_of(occupied.begin(), occupied.end(), [&](const OccupiedCell& cell) {
    return distanceToPolygon(cell.world_m, obstacle.footprint_m) <= kTolerance_m;
  });
}

int seenPointsOf(const SeenCells& seen, const TruthObstacle& obstacle) {
  int sum = 0;
  for (const auto& [key, count] : seen.counts()) {
    sum += distanceToPolygon(SeenCells::middleOf(key), obstacle.footprint_m) < SeenCells::kCell_m ? count : 0;
  }
  return sum;
}

cv::Mat highestWithin(const TruthHeights& heights, double radius_m) {
  cv::Mat known = heights.height_m.clone();
  cv::patchNaNs(known, 0.0);
  const int side = 2 * static_cast<int>(std::lround(radius_m / heights.cell_size_m)) + 1;
  cv::Mat highest;
  cv::dilate(known, highest, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return highest;
}

}  // namespace vcharge::internal
