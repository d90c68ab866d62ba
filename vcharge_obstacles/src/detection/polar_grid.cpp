#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

void PolarGridOptions::validate() const {
  requireField(num_rays >= 8 && num_rays <= 3600, "num_rays", "must be in [8, 3600]", num_rays);
  requireField(min_range_m > 0.0, "min_range_m", "must be positive", min_range_m);
  requireField(max_range_m > min_range_m && std::isfinite(max_range_m), "max_range_m",
               "must be above min_range_m", max_range_m);
  const double bins = (1.0 / min_range_m - 1.0 / max_range_m) / inverse_range_step_per_m;
  requireField(bins >= 3.0 && bins <= 10000.0, "inverse_range_step_per_m",
               "must divide the ranges into 3 to 10000 bins", inverse_range_step_per_m);
}

PolarGrid::PolarGrid(const PolarGridOptions& options) {
  options.validate();
  num_rays_ = options.num_rays;
  num_bins_ = static_cast<int>(
      std::ceil((1.0 / options.min_range_m - 1.0 / options.max_range_m) / options.inverse_range_step_per_m));
  inverse_increment_ = options.num_rays / (2.0 * M_PI);
  min_inverse_ = static_cast<float>(1.0 / options.max_range_m);
  bins_per_inverse_ = static_cast<float>(1.0 / options.inverse_range_step_per_m);
}

}  // namespace vcharge
