#include <algorithm>
#include <cmath>

#include "vcharge_obstacles/local_obstacle_map.h"

namespace vcharge {
namespace {

// Observations of a camera that has moved less have correlated errors, and weigh less.
constexpr double kIndependentMotion_m = 0.1;
// At rest, maps count by time, so that what came shows within some 0.3 s.
constexpr double kFullWeight_s = 0.08;
// Log-odds of one full observation at rest, as in motion. Hidden ground counts as much as bare ground.
constexpr float kOccupiedLogOdds = 0.9F;
constexpr float kGroundLogOdds = 0.6F;
// Bounds of the log-odds at rest, where errors repeat: two maps that show an obstacle, or bare ground.
constexpr float kMostAtRest = 2.0F * kOccupiedLogOdds;
constexpr float kLeastAtRest = -2.0F * kGroundLogOdds;
// At these log-odds at rest a cell is no longer free, nor when they fall again. Hidden ground gets no
// further.
constexpr float kTakesFreedom = 0.9F;

}  // namespace

double LocalObstacleMap::weightOf(const CameraObstacles& seen, const Eigen::Vector2d& position_m) {
  const auto [last, is_first] = last_camera_position_.try_emplace(seen.camera_name, position_m);
  const double moved_m = (position_m - last->second).norm();
  last->second = position_m;
  return is_first ? 1.0 : std::min(1.0, moved_m / kIndependentMotion_m);
}

double LocalObstacleMap::weightAtRest(const CameraObstacles& seen) {
  const auto [last, is_first] = last_at_rest_.try_emplace(seen.camera_name, seen.stamp);
  const double waited_s = toSeconds(seen.stamp - last->second);
  last->second = seen.stamp;
  return is_first ? 1.0 : std::clamp(waited_s / kFullWeight_s, 0.0, 1.0);
}

void LocalObstacleMap::takeFreedom(Timestamp stamp, Cell* cell) {
  if (cell->log_odds < 0.0F) {
    cell->lost_log_odds = cell->log_odds;
    cell->lost_ns = stamp.nanoseconds();
    cell->log_odds = 0.0F;
  }
}

void LocalObstacleMap::raiseAtRest(float log_odds, float most, Timestamp stamp, Cell* cell) {
  cell->rest_log_odds = std::max(cell->rest_log_odds, std::min(cell->rest_log_odds + log_odds, most));
  if (cell->rest_log_odds >= kTakesFreedom) {
    takeFreedom(stamp, cell);
  }
}

void LocalObstacleMap::hideAtRest(double weight, Timestamp stamp, Cell* cell) {
  raiseAtRest(static_cast<float>(weight) * kGroundLogOdds, kTakesFreedom, stamp, cell);
}

bool LocalObstacleMap::occupyAtRest(double mass, Timestamp stamp, Cell* cell) const {
  const float before = cell->rest_log_odds;
  raiseAtRest(static_cast<float>(mass) * kOccupiedLogOdds, kMostAtRest, stamp, cell);
  return cell->rest_log_odds > before && cell->log_odds < static_cast<float>(options_.occupied_threshold);
}

void LocalObstacleMap::restoreFree(Timestamp since, Timestamp stamp, const GroundArea& is_same) {
  const RigidTransform vehicle_from_fixed = fixed_from_vehicle_.inverse();
  const double cell_m = options_.cell_size_m;
  for (int64_t y = cells_.firstY(); y < cells_.firstY() + cells_.size(); ++y) {
    for (int64_t x = cells_.firstX(); x < cells_.firstX() + cells_.size(); ++x) {
      Cell& cell = cells_.at(x, y);
      if (cell.lost_ns <= since.nanoseconds() || cell.log_odds > 0.0F || cell.rest_log_odds > 0.0F ||
          stamp.nanoseconds() < cell.held_until_ns) {
        continue;
      }
      const Eigen::Vector3d middle_m((x + 0.5) * cell_m, (y + 0.5) * cell_m, 0.0);
      if (is_same((vehicle_from_fixed * middle_m).head<2>())) {
        cell.log_odds = std::min(cell.log_odds, cell.lost_log_odds);
        cell.lost_ns = kNever;
      }
    }
  }
}

void LocalObstacleMap::clearAtRest(double mass, Cell* cell) {
  cell->rest_log_odds =
      std::max(cell->rest_log_odds - static_cast<float>(mass) * kGroundLogOdds, kLeastAtRest);
}

}  // namespace vcharge
