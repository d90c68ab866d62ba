#pragma once

#include <vector>

#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {

/// What the rays of one camera that cross a cell of the map say about its ground.
struct CellLook {
  double free_share = 0.0;
  double hidden_share = 0.0;
  double unknown_share = 0.0;
  double changed_share = 0.0;
  bool blocked = false;  ///< an obstacle stands in the cell, or hides it
};

/// Looks at the cells of a map through one camera's sectors.
class CellLooker {
 public:
  /// seen and grid must outlive it; cell_m: side of the map's cells.
  CellLooker(const CameraObstacles& seen, const PolarGrid& grid, double cell_m);

  /// Of the cell in a direction (vehicle's axes) and range from the camera, whose bin is given. All rays that
  /// cross the cell speak; one that meets an obstacle there silences the others.
  CellLook look(double angle_rad, double range_m, int bin) const;
  /// Whether ground in that direction and range looks otherwise than before because of something that stands
  /// there, or before it: whatever rises from the ground does not follow its plane.
  bool isExplained(double angle_rad, double range_m) const;

 private:
  void bridgeGaps();
  const PolarObstacle* nearestBodyOn(int ray) const;
  bool blocks(int ray, double range_m) const;

  const CameraObstacles& seen_;
  const PolarGrid& grid_;
  const double cell_m_;
  std::vector<std::vector<const PolarObstacle*>> obstacles_of_ray_;
  std::vector<double> bridge_m_;  // by ray: range of a body between two obstacles beside it; else infinite
};

}  // namespace vcharge
