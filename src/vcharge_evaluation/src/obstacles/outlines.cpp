#include "vcharge_evaluation/outlines.h"

#include <algorithm>
#include <limits>

namespace vcharge {
namespace {

Eigen::Vector2d nearestOnSegment(const Eigen::Vector2d& point, const Eigen::Vector2d& a,
                                 const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length_square = along.squaredNorm();
  const double fraction =
      length_square > 0.0 ? std::clamp((point - a).dot(along) / length_square, 0.0, 1.0) : 0.0;
  return a + fraction * along;
}

// Twice the signed area of a triangle: positive if it is counter-clockwise.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// Whether edges of two outlines cross. Outlines can do so without a corner of either inside the other.
bool edgesCross(const Outline& first, const Outline& second) {
  for (size_t i = 0; i < first.size(); ++i) {
    const Eigen::Vector2d& a = first[i];
    const Eigen::Vector2d& b = first[(i + 1) % first.size()];
    for (size_t j = 0; j < second.size(); ++j) {
      const Eigen::Vector2d& c = second[j];
      const Eigen::Vector2d& d = second[(j + 1) % second.size()];
      if (turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

Outline vehicleOutline(const RigidTransform& frame_from_vehicle, double front_m, double rear_m,
                       double half_width_m) {
  Outline corners;
  for (const auto& [x, y] : {std::pair(front_m, half_width_m),
                             {rear_m, half_width_m},
                             {rear_m, -half_width_m},
                             {front_m, -half_width_m}}) {
    corners.emplace_back((frame_from_vehicle * Eigen::Vector3d(x, y, 0.0)).head<2>());
  }
  return corners;
}

Eigen::Vector2d nearestPoint(const Outline& outline, const Eigen::Vector2d& point_m) {
  Eigen::Vector2d nearest = outline.front();
  double least = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& a = outline[i];
    const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
    const Eigen::Vector2d on_edge = nearestOnSegment(point_m, a, b);
    const double distance_square = (on_edge - point_m).squaredNorm();
    if (distance_square < least) {
      least = distance_square;
      nearest = on_edge;
    }
    if ((a.y() > point_m.y()) != (b.y() > point_m.y()) &&
        point_m.x() < a.x() + (b.x() - a.x()) * (point_m.y() - a.y()) / (b.y() - a.y())) {
      inside = !inside;
    }
  }
  return inside ? point_m : nearest;
}

double distanceToPolygon(const Eigen::Vector2d& point_m, const Outline& outline) {
  return (nearestPoint(outline, point_m) - point_m).norm();
}

double distanceBetween(const Outline& a, const Outline& b) {
  if (edgesCross(a, b)) {
    return 0.0;
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& corner : a) {
    nearest = std::min(nearest, distanceToPolygon(corner, b));
  }
  for (const Eigen::Vector2d& corner : b) {
    nearest = std::min(nearest, distanceToPolygon(corner, a));
  }
  return nearest;
}

Eigen::Vector2d nearestPoint(const Outline& outline, const Outline& other) {
  Eigen::Vector2d nearest = outline.front();
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Eigen::Vector2d& own, const Eigen::Vector2d& of_other) {
    const double distance_square = (own - of_other).squaredNorm();
    if (distance_square < least) {
      least = distance_square;
      nearest = own;
    }
  };
  for (const Eigen::Vector2d& corner : other) {
    consider(nearestPoint(outline, corner), corner);
  }
  for (const Eigen::Vector2d& corner : outline) {
    consider(corner, nearestPoint(other, corner));
  }
  return nearest;
}

}  // namespace vcharge
