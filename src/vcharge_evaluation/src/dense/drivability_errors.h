#pragma once

#include <vector>

#include "poses/map_in_world.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/height_map_errors.h"

namespace vcharge {

/// Errors of the drivable grid of a map with the default DrivabilityOptions. `seen`: CV_8UC1 of the map's
/// size, not 0 where the true surface is visible.
DrivabilityErrors judgeDrivability(const HeightMap& map, const MapInWorld& in_world, const HeightMap& truth,
                                   const Trajectory& world_from_vehicle, const cv::Mat& seen,
                                   const std::vector<HeightStep>& steps, const IsRigid& is_rigid,
                                   double step_m);

}  // namespace vcharge
