#include "vcharge_dense/plane_sweep_options.h"

#include <cmath>

namespace vcharge {

PoseNoiseOptions PoseNoiseOptions::trajectory() {
  PoseNoiseOptions noise;
  noise.scale = 0.001;
  noise.translation_m = 0.002;
  noise.translation_m_per_sqrt_m = 0.0;
  noise.rotation_rad = 0.0006;
  noise.rotation_rad_per_sqrt_m = 0.0;
  return noise;
}

void PlaneSweepOptions::checkFields() const {
  requireField(std::isfinite(max_distance_m) && max_distance_m > min_distance_m, "max_distance_m",
               "must be finite and larger than min_distance_m", max_distance_m);
  requireField(num_ground_planes == 0 || num_ground_planes >= 3, "num_ground_planes",
               "must be 0 or at least 3", num_ground_planes);
  requireField(num_refinement_steps != 1, "num_refinement_steps", "must be 0 or at least 2",
               num_refinement_steps);
}

}  // namespace vcharge
