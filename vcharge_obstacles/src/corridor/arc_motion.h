#pragma once

#include <array>

#include <Eigen/Core>

namespace vcharge {

/// An axis-aligned rectangle.
struct Box2 {
  Eigen::Vector2d min_m, max_m;

  bool contains(const Eigen::Vector2d& point_m) const {
    return (point_m.array() >= min_m.array()).all() && (point_m.array() <= max_m.array()).all();
  }
  /// Counter-clockwise, beginning at min_m.
  std::array<Eigen::Vector2d, 4> corners() const {
    return {min_m, Eigen::Vector2d(max_m.x(), min_m.y()), max_m, Eigen::Vector2d(min_m.x(), max_m.y())};
  }
};

/// A plane that moves along an arc of constant curvature: its points move along concentric circles, or along
/// parallel lines if the curvature is zero. Travel is the arc length of the point at `start_m`.
class ArcMotion {
 public:
  /// `heading`: unit direction in which start_m moves first. curvature_per_m is positive to the left of it.
  ArcMotion(const Eigen::Vector2d& start_m, const Eigen::Vector2d& heading, double curvature_per_m);

  bool isStraight() const { return is_straight_; }
  const Eigen::Vector2d& heading() const { return heading_; }
  /// Centre of the circles; only if the motion is not straight.
  const Eigen::Vector2d& centre_m() const { return centre_m_; }
  /// Travel of a full turn; infinity if straight.
  double fullTurn_m() const;

  /// A point of the plane after a travel.
  Eigen::Vector2d moved(const Eigen::Vector2d& point_m, double travel_m) const;
  /// Travel until a point of the plane crosses the border of the box for the first time; infinity if it never
  /// does within a full turn.
  double travelToBorder(const Eigen::Vector2d& point_m, const Box2& box) const;
  /// Travel until a point of the plane is in the box; 0 if it is there already.
  double travelInto(const Eigen::Vector2d& point_m, const Box2& box) const {
    return box.contains(point_m) ? 0.0 : travelToBorder(point_m, box);
  }

 private:
  Eigen::Vector2d heading_, centre_m_;
  double curvature_per_m_;
  bool is_straight_;
};

}  // namespace vcharge
