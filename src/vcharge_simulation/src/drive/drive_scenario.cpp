#include "vcharge_simulation/drive/drive_scenario.h"

#include <cmath>

#include "vcharge_core/base/options.h"

namespace vcharge {

void DriveScenario::validate() const {
  requireField(scene_seed >= 0, "scene_seed", "must not be negative", scene_seed);
  requireField(rig_seed >= 0, "rig_seed", "must not be negative", rig_seed);
  requireField(seed >= 0, "seed", "must not be negative", seed);
  requireField(std::isfinite(duration_s) && duration_s >= 0.0, "duration_s", "must not be negative",
               duration_s);
  requireField(image_scale >= 0.05 && image_scale <= 1.0, "image_scale", "must be in [0.05, 1]", image_scale);
  requireField(image_step >= 1, "image_step", "must be at least 1", image_step);
  requireField(exposure_gain >= 0.01 && exposure_gain <= 100.0, "exposure_gain", "must be in [0.01, 100]",
               exposure_gain);
  validateInner("odometer", odometer);
  validateInner("lens", lens);
  validateInner("response", response);
  validateInner("faults", faults);
}

}  // namespace vcharge
