#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

/// The valid pixels of a camera, every step-th column and row: where each looks, in the vehicle's axes.
/// Structure of arrays.
struct PixelRays {
  PixelRays(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, const PolarGrid& grid,
            int pixel_step);

  size_t size() const { return x.size(); }

  std::vector<int32_t> pixel;      ///< row * columns + column
  std::vector<float> x, y, z;      ///< unit ray
  std::vector<float> horizontal;   ///< its length along the ground
  std::vector<int16_t> polar_ray;  ///< sector of the grid
};

/// How many of a camera's pixels show what, per cell of the grid, where the ground is level.
struct ExpectedPixels {
  /// low_m: heights up to which a ground point clears; reference_m: height of the reference obstacle.
  ExpectedPixels(const PixelRays& rays, const PolarGrid& grid, double camera_height_m, double low_m,
                 double reference_m);

  std::vector<float> ground;    ///< rays that pass below low_m and hit the ground behind
  std::vector<float> obstacle;  ///< rays that would hit an obstacle between low_m and reference_m
};

/// Bodies may hang so high over ground that shows under them.
constexpr double kClearance_m = 0.25;

/// How far, by sector, a camera sees not the ground alone but also up to kClearance_m over it: beyond, the
/// body under which ground shows may lie outside the image.
std::vector<double> overseenRange(const PixelRays& rays, const PolarGrid& grid, double camera_height_m);

/// Adds `weight` to all cells of a sector whose middle lies between two inverse ranges. Sums up when
/// finished: cheap for long strips.
class StripSum {
 public:
  explicit StripSum(const PolarGrid& grid)
      : grid_(grid), difference_(static_cast<size_t>(grid.numRays()) * (grid.numBins() + 1), 0.0F) {}

  void add(int ray, float from_inverse, float to_inverse, float weight) {
    // A bin's middle lies half a bin above its lower end.
    int from = grid_.binOfInverse(from_inverse + half_);
    int to = grid_.binOfInverse(to_inverse + half_) - 1;
    from = from < 0 ? 0 : from;
    to = to >= grid_.numBins() ? grid_.numBins() - 1 : to;
    if (from > to) {
      return;
    }
    float* row = &difference_[static_cast<size_t>(ray) * (grid_.numBins() + 1)];
    row[from] += weight;
    row[to + 1] -= weight;
  }
  /// By PolarGrid::index.
  std::vector<float> finish() const;

 private:
  const PolarGrid& grid_;
  const float half_ = static_cast<float>(grid_.binWidth() * 0.5);
  std::vector<float> difference_;
};

}  // namespace vcharge
