#include "vcharge_geometry/robust/robust_options.h"

#include "vcharge_core/base/options.h"

namespace vcharge {

void RobustOptions::validate() const {
  requireField(max_error_rad > 0.0 && max_error_rad < 0.5, "max_error_rad", "must be in (0, 0.5)",
               max_error_rad);
  requireField(confidence > 0.0 && confidence < 1.0, "confidence", "must be in (0, 1)", confidence);
  requireField(min_iterations >= 1, "min_iterations", "must be at least 1", min_iterations);
  requireField(max_iterations >= min_iterations, "max_iterations", "must be at least min_iterations",
               max_iterations);
  requireField(min_inliers >= 1, "min_inliers", "must be at least 1", min_inliers);
  requireField(max_relative_scale_deviation > 0.0, "max_relative_scale_deviation", "must be positive",
               max_relative_scale_deviation);
}

}  // namespace vcharge
