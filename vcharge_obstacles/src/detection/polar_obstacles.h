#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {

/// Ranges interpolated between a high obstacle and the ground before it form a ramp. Its observations have
/// this weight because it may also be a kerb.
constexpr double kRampWeight = 0.25;
/// Obstacles with this mean confidence or more have full weight.
constexpr double kReferenceConfidence = 0.9;

/// A point that rises above the ground, in a cell of the polar grid.
struct PolarPoint {
  int16_t ray, bin;
  float range_m, range_sigma_m;  // horizontal range
  float height_m, height_sigma_m;
  float confidence;
  float weight;
};

/// The points of a range map, collected in a polar grid.
class PolarPoints {
 public:
  explicit PolarPoints(const PolarGrid& grid)
      : grid_(grid), obstacle_weight_(grid.size(), 0.0F), ground_weight_(grid.size(), 0.0F) {}

  void addObstacle(const PolarPoint& point) {
    points_.push_back(point);
    obstacle_weight_[grid_.index(point.ray, point.bin)] += point.weight;
  }
  void addGround(int ray, int bin, float weight) { ground_weight_[grid_.index(ray, bin)] += weight; }
  /// Must be called after the last point was added.
  void sortByRay();

  const PolarGrid& grid() const { return grid_; }
  float obstacleWeight(int ray, int bin) const { return weightAt(obstacle_weight_, ray, bin); }
  float groundWeight(int ray, int bin) const { return weightAt(ground_weight_, ray, bin); }
  /// Obstacle points of a sector in the bins from_bin to to_bin.
  std::vector<PolarPoint> pointsOf(int ray, int from_bin, int to_bin) const;

 private:
  float weightAt(const std::vector<float>& weights, int ray, int bin) const {
    return bin < 0 || bin >= grid_.numBins() ? 0.0F : weights[grid_.index(ray, bin)];
  }

  const PolarGrid& grid_;
  std::vector<float> obstacle_weight_, ground_weight_;
  std::vector<PolarPoint> points_;
  std::vector<size_t> first_of_ray_;
};

/// Cells with enough obstacle points, nearest first on each ray, refined by their points. expected_pixels:
/// number of pixels that would show a reference obstacle, by PolarGrid::index.
std::vector<PolarObstacle> findPolarObstacles(const PolarPoints& points,
                                              const std::vector<float>& expected_pixels, double min_support);

/// The first obstacle on each ray, and the range up to which its ground is bare without a gap.
ObstacleScan makePolarScan(const PolarGrid& grid, const std::vector<PolarObstacle>& obstacles,
                           const std::vector<float>& free_fraction,
                           const std::vector<float>& expected_ground);

}  // namespace vcharge
