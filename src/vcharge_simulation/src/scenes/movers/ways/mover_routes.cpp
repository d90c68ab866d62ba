#include "scenes/movers/ways/mover_routes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTransition_m = 3.0;
// Tighter than the own car's, since the rectangle on the right-hand side of clockwise lanes is smaller.
constexpr double kCornerRadius_m = 4.2;
// Curve out of a bay.
constexpr double kBayCurvature_per_m = 0.2;
constexpr double kBayTurnIn_m = 1.0;
constexpr double kBayTangent_m = 5.5;

void addTurn(double angle_rad, double curvature_per_m, double turn_in_m,
             std::vector<DrivePath::Segment>* segments) {
  const double k = std::copysign(curvature_per_m, angle_rad);
  segments->push_back({turn_in_m, 0.0, k});
  segments->push_back({std::abs(angle_rad) / curvature_per_m - turn_in_m, k, k});
  segments->push_back({turn_in_m, k, 0.0});
}

DrivePath repeated(const DrivePath& lap, double total_m) {
  DrivePath path = lap;
  while (path.length() < total_m) {
    path.append(lap);
  }
  return path;
}

}  // namespace

DrivePath walkBackAndForth(const RigidTransform& world_from_start, double leg_m, double turn_radius_m,
                           double total_m) {
  constexpr double kTurnIn_m = 0.3;
  std::vector<DrivePath::Segment> lap;
  for (int leg = 0; leg < 2; ++leg) {
    lap.push_back({leg_m, 0.0, 0.0});
    addTurn(kPi, 1.0 / turn_radius_m, kTurnIn_m, &lap);
  }
  return repeated(DrivePath(world_from_start, lap), total_m);
}

DrivePath driveAround(const MoverArea& area, double aside_m, double total_m, Random* random) {
  const bool mirrored = random->chance(0.5);
  if (area.is_road) {
    const double side = mirrored ? -1.0 : 1.0;
    const double from_x = mirrored ? area.bounds.max_x : area.bounds.min_x;
    return DrivePath(RigidTransform::planar(from_x + side * 5.0, -side * aside_m, mirrored ? kPi : 0.0),
                     {{area.bounds.width() - 10.0, 0.0, 0.0}});
  }
  // Driven counter-clockwise, the right-hand side is outside.
  const double outwards_m = mirrored ? -aside_m : aside_m;
  const int block = random->index(3);
  const double south = (block == 1 ? 0.0 : -area.lanes.y_m) - outwards_m;
  const double north = (block == 0 ? 0.0 : area.lanes.y_m) + outwards_m;
  const double x = area.lanes.x_m + outwards_m;
  std::vector<Eigen::Vector2d> corners = {{x, south}, {x, north}, {-x, north}, {-x, south}};
  if (mirrored) {
    std::reverse(corners.begin(), corners.end());
  }
  return repeated(DrivePath::throughWaypoints(corners, true, kCornerRadius_m, kTransition_m), total_m);
}

std::optional<DrivePath> leaveBay(const MoverArea& area, const PlannedBay& bay, double axle_m, double aside_m,
                                  bool to_left) {
  const Eigen::Vector2d out(-std::cos(bay.yaw_rad), -std::sin(bay.yaw_rad));
  const double side = out.y() > 0.0 ? 1.0 : -1.0;
  // The lane that the bay opens to.
  const std::vector<double> lanes = {-area.lanes.y_m, 0.0, area.lanes.y_m};
  const double lane_y = *std::min_element(lanes.begin(), lanes.end(), [&](double a, double b) {
    const auto ahead = [&](double y) { return (y - bay.y) * side > 0.0 ? std::abs(y - bay.y) : 1e3; };
    return ahead(a) < ahead(b);
  });
  const double along_x = to_left ? -side : side;
  // On the right-hand side of the lane in the new direction.
  const double y = lane_y - along_x * aside_m;
  const Eigen::Vector2d start = Eigen::Vector2d(bay.x, bay.y) - axle_m * out;
  const double straight_m = std::abs(y - start.y()) - kBayTangent_m;
  const double turned_x = start.x() + along_x * kBayTangent_m;
  const double corner_x = along_x * (area.lanes.x_m - aside_m);
  constexpr double kCorner_m = 8.0;
  if (straight_m < 0.0 || (corner_x - turned_x) * along_x < kCorner_m) {
    return std::nullopt;
  }
  std::vector<DrivePath::Segment> turn = {{straight_m, 0.0, 0.0}};
  addTurn(to_left ? 0.5 * kPi : -0.5 * kPi, kBayCurvature_per_m, kBayTurnIn_m, &turn);
  DrivePath path(RigidTransform::planar(start.x(), start.y(), bay.yaw_rad + kPi), turn);
  // On around the block.
  const double next_y = (lane_y == 0.0 ? side * area.lanes.y_m : 0.0) + along_x * aside_m;
  path.append(DrivePath::throughWaypoints({{turned_x, y}, {corner_x, y}, {corner_x, next_y}, {0.0, next_y}},
                                          false, kCornerRadius_m, kTransition_m));
  return path;
}

}  // namespace vcharge
