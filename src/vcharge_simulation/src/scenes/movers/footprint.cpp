#include "scenes/movers/footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace vcharge {

namespace {

using Corners = std::vector<Eigen::Vector2d>;

// True if an edge of `a` has all of `b` on its outer side.
bool isSeparatedByEdgeOf(const Corners& a, const Corners& b) {
  for (size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector2d edge = a[(i + 1) % a.size()] - a[i];
    const Eigen::Vector2d outwards(edge.y(), -edge.x());
    if (std::all_of(b.begin(), b.end(),
                    [&](const Eigen::Vector2d& corner) { return outwards.dot(corner - a[i]) > 0.0; })) {
      return true;
    }
  }
  return false;
}

double smallestDistance(const Corners& corners, const Corners& outline) {
  double smallest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d edge = outline[(i + 1) % outline.size()] - outline[i];
    for (const Eigen::Vector2d& corner : corners) {
      const double along = std::clamp(edge.dot(corner - outline[i]) / edge.squaredNorm(), 0.0, 1.0);
      smallest = std::min(smallest, (outline[i] + along * edge - corner).norm());
    }
  }
  return smallest;
}

}  // namespace

Footprint::Footprint(std::vector<Eigen::Vector2d> outline)
    : corners(std::move(outline)), centre(Eigen::Vector2d::Zero()), radius(0.0) {
  for (const Eigen::Vector2d& corner : corners) {
    centre += corner / static_cast<double>(corners.size());
  }
  for (const Eigen::Vector2d& corner : corners) {
    radius = std::max(radius, (corner - centre).norm());
  }
}

double distanceBetween(const Footprint& a, const Footprint& b) {
  if (!isSeparatedByEdgeOf(a.corners, b.corners) && !isSeparatedByEdgeOf(b.corners, a.corners)) {
    return 0.0;
  }
  return std::min(smallestDistance(a.corners, b.corners), smallestDistance(b.corners, a.corners));
}

bool isNearerThan(double distance_m, const Footprint& a, const Footprint& b) {
  const double reach_m = distance_m + a.radius + b.radius;
  return (a.centre - b.centre).squaredNorm() < reach_m * reach_m && distanceBetween(a, b) < distance_m;
}

}  // namespace vcharge
