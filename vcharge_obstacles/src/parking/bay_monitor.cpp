#include "vcharge_obstacles/bay_monitor.h"

#include <cmath>

#include "parking/area_of_map.h"

namespace vcharge {
namespace {

constexpr double kConfirm_s = 0.5;

/// The cells of the map in a part of a bay.
AreaCells cellsIn(const ObstacleMap& map, const RigidTransform& fixed_from_map, Quadrangle corners_m) {
  for (Eigen::Vector2d& corner : corners_m) {
    const Eigen::Vector3d fixed_m = fixed_from_map * Eigen::Vector3d(corner.x(), corner.y(), 0.0);
    corner = fixed_m.head<2>();
  }
  return cellsOf(map, corners_m);
}

int countCells(const ObstacleMap& map, const AreaCells& cells, int8_t state) {
  return cells.box.empty() ? 0 : cv::countNonZero((map.state(cells.box) == state) & (cells.inside != 0));
}

/// What a single map tells about a bay.
BayState stateIn(const ObstacleMap& map, const RigidTransform& fixed_from_map, const ParkingBay& bay) {
  // Only faces of cars that the cameras see are occupied; single cells may be noise.
  constexpr double kMinObstacle_m2 = 0.03, kMinFree = 0.5;
  const double cell_m2 = map.cell_size_m * map.cell_size_m;
  const AreaCells inside = cellsIn(map, fixed_from_map, bay.inside());
  if (countCells(map, inside, kCellOccupied) * cell_m2 >= kMinObstacle_m2 * 0.999) {
    return BayState::kOccupied;
  }
  const AreaCells middle = cellsIn(map, fixed_from_map, bay.middle());
  // The area is that of the whole middle: a part of it may lie outside the map.
  const Quadrangle corners_m = bay.middle();
  const Eigen::Vector2d a = corners_m[2] - corners_m[0], b = corners_m[3] - corners_m[1];
  const double area_m2 = 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
  return countCells(map, middle, kCellFree) * cell_m2 >= kMinFree * area_m2 && area_m2 > 0.0
             ? BayState::kFree
             : BayState::kUnknown;
}

}  // namespace

BayMonitor::BayMonitor(const ParkingBays& bays) : claims_(bays.bays.size()) {
  for (const ParkingBay& bay : bays.bays) {
    bays_.push_back({bay, std::nullopt, std::nullopt});
    bays_.back().bay.state = BayState::kUnknown;
  }
}

bool BayMonitor::add(const ObstacleMap& map, const RigidTransform& map_from_fixed) {
  bool has_changed = false;
  if (last_ && map.stamp < *last_) {
    claims_.assign(claims_.size(), Claim());
    for (MonitoredBay& bay : bays_) {
      has_changed = has_changed || bay.observed;
      bay = {bay.bay, std::nullopt, std::nullopt};
      bay.bay.state = BayState::kUnknown;
    }
  }
  last_ = map.stamp;
  const RigidTransform fixed_from_map = map_from_fixed.inverse();
  for (size_t i = 0; i < bays_.size(); ++i) {
    MonitoredBay& bay = bays_[i];
    const BayState state = stateIn(map, fixed_from_map, bay.bay);
    if (state == BayState::kUnknown) {
      continue;
    }
    if (state != claims_[i].state) {
      claims_[i] = {state, map.stamp};
    }
    if (state != bay.bay.state && toSeconds(map.stamp - claims_[i].since) >= kConfirm_s) {
      bay.bay.state = state;
      bay.since = claims_[i].since;
      has_changed = true;
    }
    if (state == bay.bay.state) {
      bay.observed = map.stamp;
    }
  }
  return has_changed;
}

}  // namespace vcharge
