#include <cmath>

#include "vcharge_obstacles/local_obstacle_map.h"

namespace vcharge {

ObstacleMap LocalObstacleMap::snapshot() const {
  ObstacleMap map = ObstacleMap::unobserved({cells_.size(), cells_.size()}, options_.cell_size_m);
  map.stamp = stamp_;
  map.fixed_from_vehicle = fixed_from_vehicle_;
  map.origin_m = options_.cell_size_m *
                 Eigen::Vector2d(static_cast<double>(cells_.firstX()), static_cast<double>(cells_.firstY()));
  const auto cell_m = static_cast<float>(options_.cell_size_m);
  cells_.forEach([&](int64_t x, int64_t y, const Cell& cell) {
    if (cell.last_seen_ns == kNever) {
      return;
    }
    const cv::Point at(static_cast<int>(x - cells_.firstX()), static_cast<int>(y - cells_.firstY()));
    map.age_s.at<float>(at) =
        static_cast<float>(static_cast<double>(stamp_.nanoseconds() - cell.last_seen_ns) * 1e-9);
    map.state.at<int8_t>(at) = stateOf(cell);
    if (map.state.at<int8_t>(at) == kCellOccupied) {
      const auto drift_m = static_cast<float>((travel_m_ - cell.travel_m) * options_.odometry_sigma_m_per_m);
      map.point_m.at<cv::Vec2f>(at) = {static_cast<float>(at.x) * cell_m + cell.x_m,
                                       static_cast<float>(at.y) * cell_m + cell.y_m};
      map.point_sigma_m.at<float>(at) = std::hypot(cell.sigma_m, drift_m);
      map.height_m.at<float>(at) = cell.height_m;
      map.height_sigma_m.at<float>(at) = cell.height_sigma_m;
    }
  });
  return map;
}

}  // namespace vcharge
