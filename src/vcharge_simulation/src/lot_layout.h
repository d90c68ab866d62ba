#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// An axis-aligned rectangle on the ground, metres.
struct GroundRectangle {
  double min_x, min_y, max_x, max_y;
  bool contains(double x, double y) const { return x >= min_x && x <= max_x && y >= min_y && y <= max_y; }
  double width() const { return max_x - min_x; }
  double depth() const { return max_y - min_y; }
};

// Tree::variant: small trees on the lot come first, then the tall ones around it.
constexpr int kNumLotTrees = 4;
constexpr int kNumTallTrees = 3;

/// Where everything stands on the lot. The lanes run along y = -15, 0 and 15 and x = -26 and 26.
struct LotLayout {
  struct Bay {
    double x, y, yaw_rad;  ///< centre; cars point along yaw or against it
    int number;
  };
  struct Car {
    double x, y, yaw_rad;  ///< rear axle
    int shape;
    int paint;
    uint32_t seed;
  };
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
    double x, y, yaw_rad;
  };
  struct Fence {
    double x0, y0, x1, y1, z;
  };

  std::vector<GroundRectangle> islands;  ///< raised by kKerbHeight_m
  std::vector<Bay> bays;
  std::vector<Car> cars;
  std::vector<Tree> trees;
  std::vector<Bush> bushes;
  std::vector<Hedge> hedges;
  std::vector<Building> buildings;
  std::vector<Pole> poles;
  std::vector<Bin> bins;
  std::vector<Fence> fences;

  double groundHeight(double x, double y) const;
};

inline constexpr double kKerbHeight_m = 0.12;
inline constexpr double kBayWidth_m = 2.6;
inline constexpr double kBayLength_m = 4.3;

LotLayout makeLotLayout(uint64_t seed, int day, double moved_cars);

}  // namespace vcharge
