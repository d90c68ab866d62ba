#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Near end of the nearest bin of a polar grid.
constexpr double kMinPolarRange_m = 0.3;

/// Options of PolarGrid. Ranges are horizontal distances from the camera.
struct PolarGridOptions {
  VCHARGE_BEGIN_OPTIONS(PolarGridOptions);
  VCHARGE_OPTION(int, num_rays, 360, between(8, 3600), "Sectors of the full circle, also of the fused scan.");
  VCHARGE_OPTION(double, max_range_m, 12.0, above(0.5).upTo(1000.0), "Range up to which points are used.");
  VCHARGE_END_OPTIONS();
};

/// Sectors of equal angle around a camera, each divided into bins of equal inverse range, in which stereo has
/// constant precision. Bin 0 is the farthest (Haene et al., IROS 2015; paper, section Obstacle Detection).
class PolarGrid {
 public:
  explicit PolarGrid(const PolarGridOptions& options = PolarGridOptions());

  int numRays() const { return num_rays_; }
  int numBins() const { return num_bins_; }
  size_t size() const { return static_cast<size_t>(num_rays_) * static_cast<size_t>(num_bins_); }
  size_t index(int ray, int bin) const {
    return static_cast<size_t>(ray) * static_cast<size_t>(num_bins_) + static_cast<size_t>(bin);
  }

  /// Sector of a direction in (-pi, pi].
  int rayOf(double angle_rad) const {
    const int ray = static_cast<int>(std::floor((angle_rad + M_PI) * inverse_increment_));
    return ray < 0 ? 0 : (ray >= num_rays_ ? num_rays_ - 1 : ray);
  }
  /// Sector number modulo the number of sectors, for neighbouring sectors.
  int wrap(int ray) const { return (ray % num_rays_ + num_rays_) % num_rays_; }
  /// Direction of a sector's middle.
  double angle_rad(int ray) const { return -M_PI + (ray + 0.5) / inverse_increment_; }
  double increment_rad() const { return 1.0 / inverse_increment_; }

  /// Bin of an inverse range; outside [0, numBins()) if it is too near or too far.
  int binOfInverse(float inverse_range_per_m) const {
    const float bin = (inverse_range_per_m - min_inverse_) * bins_per_inverse_;
    const auto towards_zero = static_cast<int>(bin);  // std::floor is a call, for every pixel
    return towards_zero - (bin < static_cast<float>(towards_zero) ? 1 : 0);
  }
  double range_m(int bin) const {
    return 1.0 / (min_inverse_ + (static_cast<double>(bin) + 0.5) / bins_per_inverse_);
  }
  /// Width of a bin in inverse range, 1/m.
  double binWidth() const { return 1.0 / bins_per_inverse_; }
  double maxRange_m() const { return 1.0 / min_inverse_; }

 private:
  int num_rays_, num_bins_;
  double inverse_increment_;
  float min_inverse_, bins_per_inverse_;
};

}  // namespace vcharge
