#include "corridor/arc_motion.h"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace vcharge {
namespace {

// Below this curvature a path of 10 m deviates from a line by less than 1 mm.
constexpr double kStraight_per_m = 1e-5;
constexpr double kNever = std::numeric_limits<double>::infinity();
// Rounding of a crossing on a border, as seen from the other coordinate.
constexpr double kRounding_m = 1e-9;

/// Travel along a line until the point first crosses the border of a box.
double lineToBorder(const Eigen::Vector2d& point_m, const Eigen::Vector2d& heading, const Box2& box) {
  double first_m = kNever;
  for (int axis = 0; axis < 2; ++axis) {
    for (const double border_m : {box.min_m[axis], box.max_m[axis]}) {
      const double travel_m = (border_m - point_m[axis]) / heading[axis];  // infinite or NaN if parallel
      const double other_m = point_m[1 - axis] + travel_m * heading[1 - axis];
      if (travel_m >= 0.0 && travel_m < first_m && other_m >= box.min_m[1 - axis] - kRounding_m &&
          other_m <= box.max_m[1 - axis] + kRounding_m) {
        first_m = travel_m;
      }
    }
  }
  return first_m;
}

/// Orders the directions (cosine, sine) of turns from 0 to a full one like their angles, but faster. From 0
/// to 4.
double turnOrder(const Eigen::Vector2d& turn) {
  const double slope = turn.x() / (std::abs(turn.x()) + std::abs(turn.y()));
  return turn.y() >= 0.0 ? 1.0 - slope : 3.0 + slope;
}

}  // namespace

ArcMotion::ArcMotion(const Eigen::Vector2d& start_m, const Eigen::Vector2d& heading, double curvature_per_m)
    : heading_(heading),
      centre_m_(start_m),
      curvature_per_m_(curvature_per_m),
      is_straight_(std::abs(curvature_per_m) < kStraight_per_m) {
  if (!is_straight_) {
    centre_m_ += Eigen::Vector2d(-heading.y(), heading.x()) / curvature_per_m;
  }
}

double ArcMotion::fullTurn_m() const {
  return is_straight_ ? kNever : 2.0 * M_PI / std::abs(curvature_per_m_);
}

Eigen::Vector2d ArcMotion::moved(const Eigen::Vector2d& point_m, double travel_m) const {
  if (is_straight_) {
    return point_m + travel_m * heading_;
  }
  return centre_m_ + Eigen::Rotation2Dd(curvature_per_m_ * travel_m) * (point_m - centre_m_);
}

double ArcMotion::travelToBorder(const Eigen::Vector2d& point_m, const Box2& box) const {
  if (is_straight_) {
    return lineToBorder(point_m, heading_, box);
  }
  const Eigen::Vector2d from_centre_m = point_m - centre_m_;
  const double radius_m = from_centre_m.norm();
  if (radius_m == 0.0) {
    return kNever;
  }
  const double sign = curvature_per_m_ > 0.0 ? 1.0 : -1.0;
  double first = kNever;  // as turnOrder()
  Eigen::Vector2d first_turn(0.0, 0.0);
  for (int axis = 0; axis < 2; ++axis) {
    for (const double border_m : {box.min_m[axis], box.max_m[axis]}) {
      const double along_m = border_m - centre_m_[axis];
      if (std::abs(along_m) > radius_m) {
        continue;
      }
      const double half_chord_m = std::sqrt(radius_m * radius_m - along_m * along_m);
      for (const double across_m : {-half_chord_m, half_chord_m}) {
        const double other_m = centre_m_[1 - axis] + across_m;
        if (other_m < box.min_m[1 - axis] - kRounding_m || other_m > box.max_m[1 - axis] + kRounding_m) {
          continue;
        }
        const Eigen::Vector2d crossing_m =
            axis == 0 ? Eigen::Vector2d(along_m, across_m) : Eigen::Vector2d(across_m, along_m);
        const Eigen::Vector2d turn(
            from_centre_m.dot(crossing_m),
            sign * (from_centre_m.x() * crossing_m.y() - from_centre_m.y() * crossing_m.x()));
        const double order = turnOrder(turn);
        if (order < first) {
          first = order;
          first_turn = turn;
        }
      }
    }
  }
  if (first == kNever) {
    return kNever;
  }
  const double turn_rad = std::atan2(first_turn.y(), first_turn.x());
  return (turn_rad < 0.0 ? turn_rad + 2.0 * M_PI : turn_rad) / std::abs(curvature_per_m_);
}

}  // namespace vcharge
