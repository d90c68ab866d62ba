#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/trajectory.h"
#include "vcharge_mapping/mapping_state.h"
#include "vcharge_mapping/triangulation.h"

namespace vcharge {

/// Poses of the keyframes so far, in the map: before loops are closed they drift.
Trajectory keyframePath(const MappingState& state);

/// Points of the scene that the last keyframes saw, triangulated from these alone by their poses so far; in
/// the map. Takes milliseconds: for showing while driving.
std::vector<Eigen::Vector3d> recentLandmarks(const MappingState& state, const TriangulationOptions& options,
                                             int num_keyframes);

}  // namespace vcharge
