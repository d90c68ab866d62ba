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

void LocalObstacleMap::raiseAtRest(float log_odds, float most, Cell* cell) {
  cell->rest_log_odds = std::max(cell->rest_log_odds, std::min(cell->rest_log_odds + log_odds, most));
  if (cell->rest_log_odds >= kTakesFreedom) {
    cell->log_odds = std::max(cell->log_odds, 0.0F);
  }
}

void LocalObstacleMap::hideAtRest(double weight, Cell* cell) {
  raiseAtRest(static_cast<float>(weight) * kGroundLogOdds, kTakesFreedom, cell);
}

bool LocalObstacleMap::occupyAtRest(double mass, Cell* cell) const {
  const float before = cell->rest_log_odds;
  raiseAtRest(static_cast<float>(mass) * kOccupiedLogOdds, kMostAtRest, cell);
  return cell->rest_log_odds > before && cell->log_odds < static_cast<float>(options_.occupied_threshold);
}

void LocalObstacleMap::clearAtRest(double mass, Cell* cell) {
  cell->rest_log_odds =
      std::max(cell->rest_log_odds - static_cast<float>(mass) * kGroundLogOdds, kLeastAtRest);
}

}  // namespace vcharge
