#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Options of the polar grid. Ranges are horizontal distances from the camera.
struct PolarGridOptions {
  int num_rays = 360;  ///< of the full circle
  double min_range_m = 0.3;
  double max_range_m = 12.0;
  double inverse_range_step_per_m = 0.02;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("num_rays", num_rays);
    visit("min_range_m", min_range_m);
    visit("max_range_m", max_range_m);
    visit("inverse_range_step_per_m", inverse_range_step_per_m);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Sectors of equal angle around a camera, each divided into bins of equal inverse range, which is what
/// stereo measures: bin 0 ends at max_range_m, the last bin at min_range_m (Haene et al., IROS 2015; paper,
/// section Obstacle Detection).
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
  /// As a sector's number may be after steps to neighbours.
  int wrap(int ray) const { return (ray % num_rays_ + num_rays_) % num_rays_; }
  /// Of the sector's middle.
  double angle_rad(int ray) const { return -M_PI + (ray + 0.5) / inverse_increment_; }
  double increment_rad() const { return 1.0 / inverse_increment_; }

  /// Bin of an inverse range; outside [0, numBins()) where it is too near or too far.
  int binOfInverse(float inverse_range_per_m) const {
    return static_cast<int>(std::floor((inverse_range_per_m - min_inverse_) * bins_per_inverse_));
  }
  double range_m(int bin) const {
    return 1.0 / (min_inverse_ + (static_cast<double>(bin) + 0.5) / bins_per_inverse_);
  }
  /// Of inverse range.
  double binWidth() const { return 1.0 / bins_per_inverse_; }
  double maxRange_m() const { return 1.0 / min_inverse_; }

 private:
  int num_rays_, num_bins_;
  double inverse_increment_;
  float min_inverse_, bins_per_inverse_;
};

}  // namespace vcharge
