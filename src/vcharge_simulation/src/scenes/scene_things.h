#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// An axis-aligned rectangle on the ground, metres.
struct GroundRectangle {
  double min_x, min_y, max_x, max_y;
  bool contains(double x, double y) const { return x >= min_x && x <= max_x && y >= min_y && y <= max_y; }
  double width() const { return max_x - min_x; }
  double depth() const { return max_y - min_y; }
};

inline constexpr double kKerbHeight_m = 0.12;

/// Edge stones of raised areas.
struct Kerb {
  double height_m = kKerbHeight_m;
  bool is_bevelled = false;
};

// Values of Tree::variant below kNumSmallTrees are small trees, the others tall ones.
constexpr int kNumSmallTrees = 4;
constexpr int kNumTallTrees = 3;

/// Objects of a scene. Metres; x and y in the world frame, z of the lowest point.
struct ParkedCar {
  double x, y, yaw_rad;  ///< pose of the rear axle
  int shape;             ///< index into carShapes()
  int paint;             ///< 0 to kNumPaints - 1, from dark to bright
  uint32_t seed;         ///< for the number plate
  double z = 0.0;
  double pitch_rad = 0.0;  ///< slope of the ground along the car, positive if the nose points down
  double roll_rad = 0.0;   ///< positive if the left side is higher
};
inline constexpr int kNumPaints = 5;
struct Tree {
  double x, y, z, scale, yaw_rad;
  int variant;
};
struct Bush {
  double x, y, z, radius, height;
  uint32_t seed;
};
struct Hedge {
  GroundRectangle area;
  double base_z, height;
};
struct Building {
  GroundRectangle area;
  double height;
  std::string sign;
  uint32_t seed;
};
struct Pole {
  double x, y, z, height, radius;
  bool lamp;
};
struct Bin {
  double x, y, z, yaw_rad;
};
/// A plastered wall that stands alone.
struct GardenWall {
  GroundRectangle area;
  double height;
};
struct Fence {
  double x0, y0, x1, y1, z;
};

std::vector<Eigen::Vector2d> cornersOf(const GroundRectangle& area);
/// Corners of a rectangle with yaw about (x, y), counter-clockwise.
std::vector<Eigen::Vector2d> orientedRectangle(double x, double y, double yaw_rad, double min_along,
                                               double max_along, double half_width);
std::vector<Eigen::Vector2d> circleAround(double x, double y, double radius);

/// Outlines of things; those on slopes are as wide as on level ground.
Obstacle obstacleOf(const GroundRectangle& island, const Kerb& kerb, double base_z_m = 0.0);
Obstacle obstacleOf(const ParkedCar& car);
Obstacle obstacleOf(const Tree& tree);
Obstacle obstacleOf(const Bush& bush);
Obstacle obstacleOf(const Hedge& hedge);
Obstacle obstacleOf(const Building& house);
Obstacle obstacleOf(const Pole& pole);
Obstacle obstacleOf(const Bin& bin);
Obstacle obstacleOf(const GardenWall& wall);
Obstacle obstacleOf(const Fence& fence);

}  // namespace vcharge
