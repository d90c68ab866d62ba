#include "vcharge_obstacles/corridor.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "corridor/arc_motion.h"
#include "corridor/moving_polygon.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// A cell whose border the outline only touches is not swept.
constexpr double kBorder_m = 1e-6;
// Times that differ by less are equal: the smaller travel counts.
constexpr double kSameTime_s = 1e-5;
// Travel between two outlines whose hull stands for what is swept between them: with a radius of 5 m the hull
// is less than 1 mm wider.
constexpr double kHullStep_m = 0.1;

Box2 boxOf(const VehicleOutline& outline) {
  return {{outline.rear_m, -outline.half_width_m}, {outline.front_m, outline.half_width_m}};
}

/// Motion of the vehicle, in its own frame.
ArcMotion motionOf(double curvature_per_m, bool is_forward) {
  return is_forward ? ArcMotion(Eigen::Vector2d::Zero(), {1.0, 0.0}, curvature_per_m)
                    : ArcMotion(Eigen::Vector2d::Zero(), {-1.0, 0.0}, -curvature_per_m);
}

/// Motion of the ground, as seen from the vehicle.
ArcMotion groundMotionOf(double curvature_per_m, bool is_forward) {
  return motionOf(curvature_per_m, !is_forward);
}

/// Finds the travel after which the vehicle's outline first touches a square of the map. Two convex polygons
/// meet where a corner of one of them touches the other.
class OutlineContact {
 public:
  OutlineContact(const VehicleOutline& vehicle, const VehicleOutline& with_margin,
                 const Eigen::Isometry2d& fixed_from_vehicle, double curvature_per_m, bool is_forward)
      : body_(boxOf(vehicle)),
        with_margin_(boxOf(with_margin)),
        fixed_from_vehicle_(fixed_from_vehicle),
        vehicle_from_fixed_(fixed_from_vehicle.inverse()),
        ground_motion_(groundMotionOf(curvature_per_m, is_forward)),
        motion_in_fixed_(fixed_from_vehicle.translation(),
                         fixed_from_vehicle.linear() * Eigen::Vector2d(is_forward ? 1.0 : -1.0, 0.0),
                         is_forward ? curvature_per_m : -curvature_per_m) {
    const Eigen::Vector2d centre_m = ground_motion_.centre_m();
    const Eigen::Vector2d nearest_m = centre_m.cwiseMax(with_margin_.min_m).cwiseMin(with_margin_.max_m);
    least_radius_m_ = (nearest_m - centre_m).norm();
    for (const Eigen::Vector2d& corner_m : with_margin_.corners()) {
      largest_radius_m_ = std::max(largest_radius_m_, (corner_m - centre_m).norm());
    }
    largest_gain_ =
        ground_motion_.isStraight() ? 1.0 : std::max(1.0, largest_radius_m_ * std::abs(curvature_per_m));
  }

  /// Travel before which the outline cannot touch a square of the map; infinity if it never does. Fast.
  double leastTravelTo(const Eigen::Vector2d& min_in_fixed_m, double side_m) const {
    const Square square = squareAt(min_in_fixed_m, side_m);
    if (!mayTouch(square)) {
      return kNever;
    }
    const double distance_m = distanceTo(square, with_margin_) - square.half_diagonal_m;
    return std::max(0.0, distance_m / largest_gain_);
  }

  /// Whether the whole square is within a distance of the outline where the vehicle stands.
  bool isWithin(const Eigen::Vector2d& min_in_fixed_m, double side_m, double distance_m) const {
    const Square square = squareAt(min_in_fixed_m, side_m);
    return distanceTo(square, with_margin_) + square.half_diagonal_m <= distance_m;
  }

  /// Travel until the outline touches a square; infinity if it does not within a full turn, or if the square
  /// lies under the vehicle.
  double travelTo(const Eigen::Vector2d& min_in_fixed_m, double side_m) const {
    Square square = squareAt(min_in_fixed_m, side_m);
    const Eigen::Vector2d border_m(kBorder_m, kBorder_m);
    square.in_fixed = {min_in_fixed_m + border_m,
                       min_in_fixed_m + Eigen::Vector2d(side_m, side_m) - border_m};
    square.corners_m = square.in_fixed.corners();
    for (Eigen::Vector2d& corner_m : square.corners_m) {
      corner_m = vehicle_from_fixed_ * corner_m;
    }
    if (!overlaps(square, with_margin_)) {
      return travelTo(square, with_margin_);
    }
    if (!overlaps(square, body_)) {
      return travelTo(square, body_);
    }
    double first_m = kNever;
    for (const Eigen::Vector2d& corner_m : square.corners_m) {
      if (!body_.contains(corner_m)) {
        first_m = std::min(first_m, ground_motion_.travelToBorder(corner_m, body_));
      }
    }
    return first_m;
  }

 private:
  /// A cell of the map. In the vehicle frame unless named otherwise.
  struct Square {
    Box2 in_fixed;
    std::array<Eigen::Vector2d, 4> corners_m;
    Eigen::Vector2d middle_m;
    double half_diagonal_m = 0.0;
  };

  Square squareAt(const Eigen::Vector2d& min_in_fixed_m, double side_m) const {
    Square square;
    square.middle_m = vehicle_from_fixed_ * (min_in_fixed_m + Eigen::Vector2d(0.5 * side_m, 0.5 * side_m));
    square.half_diagonal_m = M_SQRT1_2 * side_m;
    return square;
  }

  static double distanceTo(const Square& square, const Box2& outline) {
    return (square.middle_m.cwiseMax(outline.min_m).cwiseMin(outline.max_m) - square.middle_m).norm();
  }

  double radiusOf(const Eigen::Vector2d& point_m) const {
    return (point_m - ground_motion_.centre_m()).norm();
  }

  /// Fast check by the radii between which the outline moves, or by its width.
  bool mayTouch(const Square& square) const {
    if (ground_motion_.isStraight()) {
      return std::abs(square.middle_m.y()) <= with_margin_.max_m.y() + square.half_diagonal_m;
    }
    const double radius_m = radiusOf(square.middle_m);
    return radius_m >= least_radius_m_ - square.half_diagonal_m &&
           radius_m <= largest_radius_m_ + square.half_diagonal_m;
  }

  bool overlaps(const Square& square, const Box2& outline) const {
    if (distanceTo(square, outline) > square.half_diagonal_m) {
      return false;
    }
    for (const Eigen::Vector2d& corner_m : square.corners_m) {
      if (outline.contains(corner_m)) {
        return true;
      }
    }
    for (const Eigen::Vector2d& corner_m : outline.corners()) {
      if (square.in_fixed.contains(fixed_from_vehicle_ * corner_m)) {
        return true;
      }
    }
    return false;
  }

  double travelTo(const Square& square, const Box2& outline) const {
    double first_m = kNever;
    for (const Eigen::Vector2d& corner_m : square.corners_m) {
      first_m = std::min(first_m, ground_motion_.travelInto(corner_m, outline));
    }
    for (const Eigen::Vector2d& corner_m : outline.corners()) {
      if (mayMeet(corner_m, square)) {
        first_m =
            std::min(first_m, motion_in_fixed_.travelInto(fixed_from_vehicle_ * corner_m, square.in_fixed));
      }
    }
    return first_m;
  }

  /// Fast check whether the path of a point of the vehicle passes near the square.
  bool mayMeet(const Eigen::Vector2d& point_m, const Square& square) const {
    const double distance_m = ground_motion_.isStraight() ? point_m.y() - square.middle_m.y()
                                                          : radiusOf(point_m) - radiusOf(square.middle_m);
    return std::abs(distance_m) <= square.half_diagonal_m;
  }

  const Box2 body_, with_margin_;
  const Eigen::Isometry2d fixed_from_vehicle_, vehicle_from_fixed_;
  const ArcMotion ground_motion_;    // in the vehicle frame
  const ArcMotion motion_in_fixed_;  // of the vehicle
  double least_radius_m_ = 0.0;
  double largest_radius_m_ = 0.0;
  double largest_gain_ = 1.0;  // largest path of a point of the outline per travel
};

Eigen::Isometry2d planar(const RigidTransform& fixed_from_vehicle) {
  Eigen::Isometry2d plane = Eigen::Isometry2d::Identity();
  plane.linear() = Eigen::Rotation2Dd(yawOfRotation(fixed_from_vehicle.rotation())).toRotationMatrix();
  plane.translation() = fixed_from_vehicle.translation().head<2>();
  return plane;
}

/// A cell that the vehicle may sweep.
struct CandidateCell {
  Eigen::Vector2d corner_m;  // the lower one, in the fixed frame
  double least_travel_m;
  int8_t state;
  double age_s;
};

/// Cells of the map, of a rim around it, and of what is swept within kUnknownTravel_m. Cells outside the map
/// are unknown. Free cells come last.
std::vector<CandidateCell> findCandidates(const ObstacleMap& map, const OutlineContact& contact,
                                          const Eigen::Vector2d& vehicle_m, double reach_m) {
  const Eigen::Array2i size(map.state.cols, map.state.rows);
  const Eigen::Array2d middle = (vehicle_m - map.origin_m).array() / map.cell_size_m;
  const double reach = (reach_m + kUnknownTravel_m) / map.cell_size_m;
  const Eigen::Array2i first = (middle - reach).floor().cast<int>().min(-1);
  const Eigen::Array2i last = (middle + reach).ceil().cast<int>().max(size);
  std::vector<CandidateCell> candidates;
  for (int row = first.y(); row <= last.y(); ++row) {
    for (int column = first.x(); column <= last.x(); ++column) {
      const Eigen::Vector2d corner_m = map.origin_m + map.cell_size_m * Eigen::Vector2d(column, row);
      const double least_travel_m = contact.leastTravelTo(corner_m, map.cell_size_m);
      if (least_travel_m < kNever) {
        const bool is_inside = row >= 0 && column >= 0 && row < size.y() && column < size.x();
        candidates.push_back({corner_m, least_travel_m,
                              is_inside ? map.state.at<int8_t>(row, column) : kCellUnobserved,
                              is_inside ? map.age_s.at<float>(row, column) : 0.0});
      }
    }
  }
  std::stable_partition(candidates.begin(), candidates.end(),
                        [](const CandidateCell& cell) { return cell.state != kCellFree; });
  return candidates;
}

/// Convex outlines of what the vehicle sweeps on successive steps of kHullStep_m, in its own frame.
std::vector<std::vector<Eigen::Vector2d>> sweptHulls(const Box2& outline, const ArcMotion& motion,
                                                     double travel_m) {
  std::vector<std::vector<Eigen::Vector2d>> hulls;
  const double end_m = std::min(travel_m, motion.fullTurn_m());
  for (int step = 0; step * kHullStep_m < end_m; ++step) {
    std::vector<cv::Point2f> points, hull;
    for (const double at_m : {step * kHullStep_m, std::min((step + 1) * kHullStep_m, end_m)}) {
      for (const Eigen::Vector2d& corner_m : outline.corners()) {
        const Eigen::Vector2d moved_m = motion.moved(corner_m, at_m);
        points.emplace_back(static_cast<float>(moved_m.x()), static_cast<float>(moved_m.y()));
      }
    }
    cv::convexHull(points, hull);
    hulls.emplace_back();
    for (const cv::Point2f& point : hull) {
      hulls.back().emplace_back(point.x, point.y);
    }
  }
  return hulls;
}

bool isFinite(const TrackedObject& object) {
  bool is_finite = object.velocity_m_per_s.allFinite();
  for (const Eigen::Vector2d& corner_m : object.footprint_m) {
    is_finite = is_finite && corner_m.allFinite();
  }
  return is_finite;
}

}  // namespace

std::array<Eigen::Vector2d, 2> Corridor::bumperAt(bool is_forward, double travel_m) const {
  const ArcMotion motion = motionOf(curvature_per_m, is_forward);
  const double x_m = is_forward ? outline.front_m : outline.rear_m;
  return {motion.moved({x_m, outline.half_width_m}, travel_m),
          motion.moved({x_m, -outline.half_width_m}, travel_m)};
}

CorridorFinder::CorridorFinder(const VehicleOutline& vehicle, const CorridorOptions& options)
    : vehicle_(vehicle), with_margin_(vehicle), options_((options.validate(), options)) {
  if (!(vehicle.front_m > vehicle.rear_m && vehicle.half_width_m > 0.0)) {
    throw std::invalid_argument("CorridorFinder: expected an outline with an area");
  }
  with_margin_.half_width_m += options_.side_margin_m;
}

Corridor CorridorFinder::find(const ObstacleMap& map, double curvature_per_m,
                              const std::vector<TrackedObject>& objects) const {
  check(map.cell_size_m > 0.0, "CorridorFinder: expected a map with cells");
  if (!std::isfinite(curvature_per_m)) {
    throw std::invalid_argument("CorridorFinder: expected a finite curvature_per_m");
  }
  Corridor corridor;
  corridor.curvature_per_m = curvature_per_m;
  corridor.outline = with_margin_;
  for (const bool is_forward : {true, false}) {
    CorridorDirection& direction = is_forward ? corridor.forward : corridor.backward;
    direction = findDirection(map, curvature_per_m, is_forward);
    direction.crossing = findCrossing(map.fixed_from_vehicle, curvature_per_m, is_forward, objects);
  }
  return corridor;
}

CorridorDirection CorridorFinder::findDirection(const ObstacleMap& map, double curvature_per_m,
                                                bool is_forward) const {
  const Eigen::Isometry2d fixed_from_vehicle = planar(map.fixed_from_vehicle);
  const OutlineContact contact(vehicle_, with_margin_, fixed_from_vehicle, curvature_per_m, is_forward);
  const double reach_m =
      std::hypot(std::max(std::abs(vehicle_.front_m), std::abs(vehicle_.rear_m)), with_margin_.half_width_m);
  CorridorDirection direction;
  direction.known_free_m = direction.free_beyond_rim_m = motionOf(curvature_per_m, is_forward).fullTurn_m();
  int near = 0;
  int unknown = 0;
  for (const CandidateCell& cell : findCandidates(map, contact, fixed_from_vehicle.translation(), reach_m)) {
    // Most cells are too far away to matter.
    const double limit_m = std::max(
        kUnknownTravel_m, cell.state == kCellOccupied ? direction.occupied_m : direction.free_beyond_rim_m);
    if (cell.least_travel_m > limit_m) {
      continue;
    }
    const double travel_m = contact.travelTo(cell.corner_m, map.cell_size_m);
    if (cell.state == kCellOccupied) {
      direction.occupied_m = std::min(direction.occupied_m, travel_m);
    }
    if (cell.state != kCellFree) {
      direction.known_free_m = std::min(direction.known_free_m, travel_m);
      if (cell.state == kCellOccupied || !contact.isWithin(cell.corner_m, map.cell_size_m, kBlindRim_m)) {
        direction.free_beyond_rim_m = std::min(direction.free_beyond_rim_m, travel_m);
      }
    } else if (travel_m < direction.free_beyond_rim_m && !(cell.age_s <= direction.oldest_age_s)) {
      direction.oldest_age_s = cell.age_s;
    }
    if (travel_m <= kUnknownTravel_m) {
      ++near;
      unknown += cell.state == kCellUnobserved ? 1 : 0;
    }
  }
  if (direction.free_beyond_rim_m <= kBlindRim_m) {  // nothing is known to be free behind the rim
    direction.free_beyond_rim_m = direction.known_free_m;
  }
  direction.unknown_fraction = near == 0 ? 1.0 : static_cast<double>(unknown) / near;
  return direction;
}

std::optional<CrossingObject> CorridorFinder::findCrossing(const RigidTransform& fixed_from_vehicle,
                                                           double curvature_per_m, bool is_forward,
                                                           const std::vector<TrackedObject>& objects) const {
  if (objects.empty()) {
    return std::nullopt;
  }
  const Eigen::Isometry2d vehicle_from_fixed = planar(fixed_from_vehicle).inverse();
  const auto hulls =
      sweptHulls(boxOf(with_margin_), motionOf(curvature_per_m, is_forward), options_.horizon_m);
  std::optional<CrossingObject> nearest;
  for (const TrackedObject& object : objects) {
    if (!isFinite(object)) {
      continue;
    }
    std::vector<Eigen::Vector2d> footprint_m;
    for (const Eigen::Vector2d& corner_m : object.footprint_m) {
      footprint_m.push_back(vehicle_from_fixed * corner_m);
    }
    const Eigen::Vector2d velocity = vehicle_from_fixed.linear() * object.velocity_m_per_s.head<2>();
    std::optional<CrossingObject> first;
    for (size_t step = 0; step < hulls.size(); ++step) {
      const std::optional<double> time_s = timeToTouch_s(footprint_m, velocity, hulls[step]);
      if (time_s && *time_s <= kCrossingTime_s && (!first || *time_s < first->time_s - kSameTime_s)) {
        first = {object.id, *time_s, static_cast<double>(step) * kHullStep_m};
      }
    }
    const auto isBehind = [&](const Eigen::Vector2d& corner_m) {
      const double x_m = corner_m.x() + velocity.x() * first->time_s;
      return is_forward ? x_m <= vehicle_.rear_m + kBorder_m : x_m >= vehicle_.front_m - kBorder_m;
    };
    if (first && !std::all_of(footprint_m.begin(), footprint_m.end(), isBehind) &&
        (!nearest || first->time_s < nearest->time_s)) {
      nearest = first;
    }
  }
  return nearest;
}

}  // namespace vcharge
