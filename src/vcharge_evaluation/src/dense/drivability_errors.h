#pragma once

#include <vector>

#include "poses/map_in_world.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/height_map_errors.h"

namespace vcharge {

/// What a planner makes of a map, with the default DrivabilityOptions: of the faces of high things, of what
/// is inside of them, and of open ground. `seen`: CV_8UC1 of the map's cells, not 0 where the true surface
/// is.
DrivabilityErrors judgeDrivability(const HeightMap& map, const MapInWorld& in_world, const HeightMap& truth,
                                   const Trajectory& world_from_vehicle, const cv::Mat& seen,
                                   const std::vector<HeightStep>& steps, const IsRigid& is_rigid,
                                   double step_m);

}  // namespace vcharge
