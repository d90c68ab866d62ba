#include "corridor/moving_polygon.h"

#include <algorithm>
#include <limits>

namespace vcharge {
namespace {

struct Interval {
  double min_m = std::numeric_limits<double>::infinity();
  double max_m = -std::numeric_limits<double>::infinity();
};

Interval project(const std::vector<Eigen::Vector2d>& polygon_m, const Eigen::Vector2d& axis) {
  Interval interval;
  for (const Eigen::Vector2d& corner_m : polygon_m) {
    const double along_m = corner_m.dot(axis);
    interval.min_m = std::min(interval.min_m, along_m);
    interval.max_m = std::max(interval.max_m, along_m);
  }
  return interval;
}

/// Time during which two polygons overlap.
struct Overlap {
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();

  /// Shortens it to the time during which the projections on an axis overlap.
  void restrict(const Interval& moving, double speed_m_per_s, const Interval& standing) {
    const double to_near_m = standing.min_m - moving.max_m;
    const double to_far_m = standing.max_m - moving.min_m;
    if (speed_m_per_s == 0.0) {
      to_s = to_near_m > 0.0 || to_far_m < 0.0 ? -1.0 : to_s;
    } else {
      const double near_s = to_near_m / speed_m_per_s;
      const double far_s = to_far_m / speed_m_per_s;
      from_s = std::max(from_s, std::min(near_s, far_s));
      to_s = std::min(to_s, std::max(near_s, far_s));
    }
  }
};

}  // namespace

std::optional<double> timeToTouch_s(const std::vector<Eigen::Vector2d>& moving_m,
                                    const Eigen::Vector2d& velocity_m_per_s,
                                    const std::vector<Eigen::Vector2d>& standing_m) {
  if (moving_m.empty() || standing_m.empty()) {
    return std::nullopt;
  }
  Overlap overlap;
  for (const auto* polygon : {&moving_m, &standing_m}) {
    for (size_t i = 0; i < polygon->size(); ++i) {
      const Eigen::Vector2d edge_m = (*polygon)[(i + 1) % polygon->size()] - (*polygon)[i];
      const double length_m = edge_m.norm();
      if (length_m > 0.0) {
        const Eigen::Vector2d axis = Eigen::Vector2d(edge_m.y(), -edge_m.x()) / length_m;
        overlap.restrict(project(moving_m, axis), velocity_m_per_s.dot(axis), project(standing_m, axis));
      }
    }
  }
  return overlap.from_s <= overlap.to_s ? std::optional<double>(overlap.from_s) : std::nullopt;
}

}  // namespace vcharge
