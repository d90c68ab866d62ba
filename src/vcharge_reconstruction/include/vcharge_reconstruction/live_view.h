#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_reconstruction/mapping_state.h"
#include "vcharge_reconstruction/triangulation.h"

namespace vcharge {

/// Poses of the keyframes so far, in the map: before loops are closed they drift.
Trajectory keyframePath(const MappingState& state);

/// Keyframes from `begin` on with what was seen in them, numbered from there; without images.
MappingData lastPart(const MappingData& data, int32_t begin);

/// Points of the scene that the last keyframes saw, triangulated from these alone by their poses so far; in
/// the map. Takes milliseconds: for showing while driving.
std::vector<Eigen::Vector3d> recentLandmarks(const MappingState& state, const TriangulationOptions& options,
                                             int num_keyframes);

}  // namespace vcharge
