#include "scenes/movers/standing_obstacles.h"

#include <algorithm>

namespace vcharge {

namespace {

constexpr double kClearance_m = 0.2;
constexpr double kKerbClearance_m = 0.05;
constexpr double kPathStep_m = 0.2;

bool isInside(const Footprint& outline, const Obstacle& area) {
  return std::all_of(outline.corners.begin(), outline.corners.end(), [&](const Eigen::Vector2d& corner) {
    for (size_t i = 0; i < area.footprint_m.size(); ++i) {
      const Eigen::Vector2d& a = area.footprint_m[i];
      const Eigen::Vector2d edge = area.footprint_m[(i + 1) % area.footprint_m.size()] - a;
      if (edge.x() * (corner - a).y() - edge.y() * (corner - a).x() < kKerbClearance_m * edge.norm()) {
        return false;
      }
    }
    return true;
  });
}

}  // namespace

StandingObstacles::StandingObstacles(const Scene& scene, const GroundRectangle& bounds) : bounds_(bounds) {
  for (const Obstacle& obstacle : scene.obstacles) {
    standing_.push_back({&obstacle, Footprint(obstacle.footprint_m)});
  }
}

const StandingObstacles::Standing* StandingObstacles::raisedAreaUnder(const Footprint& outline) const {
  const auto found = std::find_if(standing_.begin(), standing_.end(), [&](const Standing& standing) {
    return standing.obstacle->kind == "kerb" && isInside(outline, *standing.obstacle);
  });
  return found != standing_.end() ? &*found : nullptr;
}

double StandingObstacles::groundUnder(const PlannedMover& mover) const {
  const Standing* raised = raisedAreaUnder(Footprint(mover.outlineAt(0.0)));
  return raised != nullptr ? raised->obstacle->top_z_m : 0.0;
}

double StandingObstacles::freeLength(double from_m, double to_m, const PlannedMover& mover) const {
  const Standing* raised = raisedAreaUnder(Footprint(mover.outlineAt(from_m - mover.start_m)));
  for (double along_m = from_m; along_m <= to_m; along_m += kPathStep_m) {
    if (!isFree(Footprint(mover.outlineAt(along_m - mover.start_m)), raised, mover.height_m)) {
      return std::max(0.0, along_m - from_m - kPathStep_m);
    }
  }
  return to_m - from_m;
}

bool StandingObstacles::isFree(const Footprint& outline, const Standing* raised, double height_m) const {
  for (const Eigen::Vector2d& corner : outline.corners) {
    if (!bounds_.contains(corner.x(), corner.y())) {
      return false;
    }
  }
  if (raised != nullptr && !isInside(outline, *raised->obstacle)) {
    return false;
  }
  return std::none_of(standing_.begin(), standing_.end(), [&](const Standing& standing) {
    const bool is_kerb = standing.obstacle->kind == "kerb";
    return &standing != raised && standing.obstacle->base_z_m < height_m + kClearance_m &&
           isNearerThan(is_kerb ? kKerbClearance_m : kClearance_m, outline, standing.outline);
  });
}

}  // namespace vcharge
