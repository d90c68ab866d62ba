#pragma once

#include "vcharge_core/dense_maps/step_map.h"
#include "vcharge_obstacles/step_mapper.h"

namespace vcharge {

/// Finds the steps in the heights of a map. On input, sigma_m is the standard deviation of ground_m; on
/// output, height_m is set, and sigma_m is that of the step where there is one.
void findSteps(const StepMapperOptions& options, StepMap* map);

}  // namespace vcharge
