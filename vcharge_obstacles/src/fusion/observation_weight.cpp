#include <algorithm>
#include <cmath>

#include "vcharge_obstacles/local_obstacle_map.h"

namespace vcharge {
namespace {

// Observations of a camera that has moved less have correlated errors, and weigh less.
constexpr double kIndependentMotion_m = 0.1;
// Within this distance a camera stands: motion stereo measures nothing, so a range map comes from cameras
// that overlap. At rest, its errors repeat.
constexpr double kStanding_m = 0.025;
// At rest, maps count by time, so that what came shows within some 0.3 s.
constexpr double kFullWeight_s = 0.08;

}  // namespace

/// Weight of a camera's range map: maps from nearby positions use the same images, so errors correlate.
LocalObstacleMap::MapWeight LocalObstacleMap::weightOf(const CameraObstacles& seen,
                                                       const Eigen::Vector2d& position_m) {
  const auto [last, is_first] =
      last_observation_.try_emplace(seen.camera_name, LastObservation{position_m, seen.stamp});
  const double moved_m = (position_m - last->second.position_m).norm();
  const double waited_s = toSeconds(seen.stamp - last->second.stamp);
  last->second.stamp = seen.stamp;
  if (is_first) {
    return {1.0, false};
  }
  if (moved_m < kStanding_m) {
    return {std::clamp(waited_s / kFullWeight_s, 0.0, 1.0), true};
  }
  last->second.position_m = position_m;
  return {std::min(1.0, moved_m / kIndependentMotion_m), false};
}

}  // namespace vcharge
