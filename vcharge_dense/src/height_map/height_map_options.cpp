#include "vcharge_dense/height_map_options.h"

#include <cmath>

namespace vcharge {

void HeightFusionOptions::checkFields() const {
  requireField(std::isfinite(min_height_m), "min_height_m", "must be finite", min_height_m);
  requireField(std::isfinite(max_height_m) && max_height_m >= min_height_m + 2.0 * height_step_m,
               "max_height_m", "must be two height steps or more above min_height_m", max_height_m);
}

}  // namespace vcharge
