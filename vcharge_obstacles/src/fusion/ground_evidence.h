#pragma once

#include "vcharge_obstacles/ground_watch.h"
#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {

/// Adds what a camera's images tell about the ground to the observation from its ranges. Ground that fits
/// between images is bare like ground with a range, up to the first changed ground on its ray: what has come
/// there may hide the ground behind, or stand on it.
void addAppearance(GroundAppearance appearance, const PolarGrid& grid, CameraObstacles* seen);

}  // namespace vcharge
