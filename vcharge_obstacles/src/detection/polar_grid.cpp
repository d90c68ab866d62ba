#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

// Width of a bin in inverse range: 0.02 1/m is 2 cm at 1 m and 0.5 m at 5 m.
constexpr double kInverseRangeStep_per_m = 0.02;

PolarGrid::PolarGrid(const PolarGridOptions& options) {
  options.validate();
  num_rays_ = options.num_rays;
  num_bins_ = static_cast<int>(
      std::ceil((1.0 / kMinPolarRange_m - 1.0 / options.max_range_m) / kInverseRangeStep_per_m));
  inverse_increment_ = options.num_rays / (2.0 * M_PI);
  min_inverse_ = static_cast<float>(1.0 / options.max_range_m);
  bins_per_inverse_ = static_cast<float>(1.0 / kInverseRangeStep_per_m);
}

}  // namespace vcharge
