#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

/// Directions of the valid pixels of a camera in the vehicle's axes, as a structure of arrays.
struct PixelRays {
  PixelRays(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, const PolarGrid& grid);

  size_t size() const { return x.size(); }

  std::vector<int32_t> pixel;      ///< row * columns + column
  std::vector<float> x, y, z;      ///< unit ray
  std::vector<float> horizontal;   ///< length of the ray's projection on the ground
  std::vector<int16_t> polar_ray;  ///< index of the grid's sector
};

/// Number of pixels of a camera that show each cell of the grid, for level ground.
struct ExpectedPixels {
  /// low_m: height below which a ray clears the ground; reference_m: height of the reference obstacle.
  ExpectedPixels(const PixelRays& rays, const PolarGrid& grid, double camera_height_m, double low_m,
                 double reference_m);

  std::vector<float> ground;    ///< rays that pass below low_m and hit the ground behind
  std::vector<float> obstacle;  ///< rays that would hit an obstacle between low_m and reference_m
};

/// Maximum height of a body's underside above visible ground.
constexpr double kClearance_m = 0.25;

/// Range per sector up to which the image shows the space kClearance_m above the ground. Beyond it, a body
/// above visible ground may lie outside the image.
std::vector<double> fullyVisibleRange(const PixelRays& rays, const PolarGrid& grid, double camera_height_m);

/// Accumulates weights of strips between two inverse ranges of a sector, in constant time per strip.
class StripSum {
 public:
  explicit StripSum(const PolarGrid& grid)
      : grid_(grid), difference_(static_cast<size_t>(grid.numRays()) * (grid.numBins() + 1), 0.0F) {}

  /// Cells of a ray, the same in all sums of a grid: from `begin` up to but not including `end`.
  struct Strip {
    size_t begin = 0, end = 0;
  };
  Strip stripOf(int ray, float from_inverse, float to_inverse) const {
    // The strip covers the bins whose middles lie in it.
    int from = grid_.binOfInverse(from_inverse + half_);
    int to = grid_.binOfInverse(to_inverse + half_);
    from = from < 0 ? 0 : from;
    to = to > grid_.numBins() ? grid_.numBins() : to;
    const size_t first = static_cast<size_t>(ray) * (grid_.numBins() + 1);
    return from < to ? Strip{first + from, first + to} : Strip{};
  }
  void add(Strip strip, float weight) {
    if (strip.begin < strip.end) {
      difference_[strip.begin] += weight;
      difference_[strip.end] -= weight;
    }
  }
  void add(int ray, float from_inverse, float to_inverse, float weight) {
    add(stripOf(ray, from_inverse, to_inverse), weight);
  }
  /// Sums by PolarGrid::index.
  std::vector<float> finish() const;

 private:
  const PolarGrid& grid_;
  const float half_ = static_cast<float>(grid_.binWidth() * 0.5);
  std::vector<float> difference_;
};

}  // namespace vcharge
