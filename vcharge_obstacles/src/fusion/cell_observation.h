#pragma once

#include <vector>

#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {

/// Ground of a cell of the map as shown by one camera's rays that cross it. Fractions refer to the pixels
/// that would show it.
struct CellObservation {
  double free_fraction = 0.0;
  double hidden_fraction = 0.0;
  double unknown_fraction = 0.0;
  double changed_fraction = 0.0;
  bool blocked = false;  ///< an obstacle stands in the cell, or hides it
};

/// Reads the cells of a map from one camera's polar grid.
class CellObserver {
 public:
  /// seen and grid must outlive it; cell_m: side of the map's cells.
  CellObserver(const CameraObstacles& seen, const PolarGrid& grid, double cell_m);

  /// Observes the cell at a direction (vehicle's axes) and a range from the camera, whose bin is given.
  /// Averages all rays that cross the cell; an obstacle on one of them blocks it.
  CellObservation observe(double angle_rad, double range_m, int bin) const;
  /// Whether changed ground in that direction and range is explained by an obstacle that stands there or in
  /// front of it, since whatever rises from the ground does not follow the warp by its plane.
  bool isExplained(double angle_rad, double range_m) const;

 private:
  void bridgeGaps();
  const PolarObstacle* nearestBodyOn(int ray) const;
  bool blocks(int ray, double range_m) const;

  const CameraObstacles& seen_;
  const PolarGrid& grid_;
  const double cell_m_;
  std::vector<std::vector<const PolarObstacle*>> obstacles_of_ray_;
  std::vector<double> bridge_m_;  // per ray: range of the body between two of its parts, else infinite
};

}  // namespace vcharge
