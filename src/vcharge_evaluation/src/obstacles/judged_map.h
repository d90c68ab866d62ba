#pragma once

#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge::internal {

// An obstacle is visible with this many points between these heights, and is reported by an occupied cell
// within this distance.
inline constexpr int kMinSeenPoints = 15;
inline constexpr double kSeenHeight_m = 0.1;
inline constexpr double kMaxHeight_m = 2.0;
inline constexpr double kTolerance_m = 0.25;
// Ground is open if nothing of this height stands within this distance: the allowed range error of 15 cm and
// the diagonal of a cell.
inline constexpr double kOpenHeight_m = 0.08;
inline constexpr double kOpenRadius_m = 0.29;

/// An occupied cell in the world frame.
struct OccupiedCell {
  Eigen::Vector2d world_m;
  double height_m;
};

/// A fused map at the true pose of the vehicle. The map must outlive this object.
class JudgedMap {
 public:
  JudgedMap(const ObstacleMap& obstacle_map, const RigidTransform& world_from_vehicle);

  const ObstacleMap& map;
  const RigidTransform level;  ///< true pose without height, roll and pitch
  std::vector<OccupiedCell> occupied;

  /// Calls visit(column, row, state) for all cells.
  template <class Visitor>
  void forEachCell(Visitor&& visit) const {
    for (int row = 0; row < map.state.rows; ++row) {
      for (int column = 0; column < map.state.cols; ++column) {
        visit(column, row, map.state.at<int8_t>(row, column));
      }
    }
  }
  /// Centre of a cell in the map's fixed frame, and in the world.
  Eigen::Vector2d fixedOf(int column, int row) const;
  Eigen::Vector2d worldOf(int column, int row) const;
  bool reports(const TruthObstacle& obstacle) const;

 private:
  const RigidTransform world_from_fixed_;
};

/// Number of visible points on an obstacle.
int seenPointsOf(const SeenCells& seen, const TruthObstacle& obstacle);

/// Largest height within a radius of each cell, CV_32FC1; unknown heights count as 0.
cv::Mat highestWithin(const TruthHeights& heights, double radius_m);

}  // namespace vcharge::internal
