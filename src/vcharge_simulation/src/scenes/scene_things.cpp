#include "scenes/scene_things.h"

#include <cmath>

#include "vcharge_simulation/objects/car_model.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

std::vector<Eigen::Vector2d> orientedRectangle(double x, double y, double yaw_rad, double min_along,
                                               double max_along, double half_width) {
  const Eigen::Vector2d along(std::cos(yaw_rad), std::sin(yaw_rad));
  const Eigen::Vector2d across(-along.y(), along.x());
  const Eigen::Vector2d origin(x, y);
  return {origin + min_along * along - half_width * across, origin + max_along * along - half_width * across,
          origin + max_along * along + half_width * across, origin + min_along * along + half_width * across};
}

std::vector<Eigen::Vector2d> circleAround(double x, double y, double radius) {
  std::vector<Eigen::Vector2d> points;
  constexpr int kCorners = 10;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * kPi * i / kCorners;
    points.emplace_back(x + radius * std::cos(angle), y + radius * std::sin(angle));
  }
  return points;
}

std::vector<Eigen::Vector2d> cornersOf(const GroundRectangle& area) {
  return {
      {area.min_x, area.min_y}, {area.max_x, area.min_y}, {area.max_x, area.max_y}, {area.min_x, area.max_y}};
}

Obstacle obstacleOf(const GroundRectangle& island, const Kerb& kerb, double base_z_m) {
  return {"kerb", cornersOf(island), base_z_m, base_z_m + kerb.height_m};
}

Obstacle obstacleOf(const ParkedCar& car) {
  const CarShape& shape = carShapes()[static_cast<size_t>(car.shape)];
  return {"car", orientedRectangle(car.x, car.y, car.yaw_rad, shape.rear(), shape.front(), 0.5 * shape.width),
          car.z, car.z + shape.height};
}

Obstacle obstacleOf(const Tree& tree) {
  return {"tree", circleAround(tree.x, tree.y, 0.2 * tree.scale), tree.z, tree.z + 2.0 * tree.scale};
}

Obstacle obstacleOf(const Bush& bush) {
  return {"bush", circleAround(bush.x, bush.y, bush.radius), bush.z, bush.z + bush.height};
}

Obstacle obstacleOf(const Hedge& hedge) {
  return {"hedge", cornersOf(hedge.area), hedge.base_z, hedge.base_z + hedge.height};
}

Obstacle obstacleOf(const Building& house) {
  return {"building", cornersOf(house.area), 0.0, house.height};
}

Obstacle obstacleOf(const Pole& pole) {
  return {"pole", circleAround(pole.x, pole.y, pole.radius), pole.z, pole.z + pole.height};
}

Obstacle obstacleOf(const Bin& bin) {
  return {"bin", orientedRectangle(bin.x, bin.y, bin.yaw_rad, -0.3, 0.3, 0.33), bin.z, bin.z + 1.06};
}

Obstacle obstacleOf(const GardenWall& wall) {
  return {"wall", cornersOf(wall.area), 0.0, wall.height};
}

Obstacle obstacleOf(const Fence& fence) {
  const double dx = fence.x1 - fence.x0;
  const double dy = fence.y1 - fence.y0;
  return {"fence", orientedRectangle(fence.x0, fence.y0, std::atan2(dy, dx), 0.0, std::hypot(dx, dy), 0.03),
          fence.z, fence.z + 1.28};
}

}  // namespace vcharge
