#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Current poses of the keyframes in the map; they drift before loops are closed.
Trajectory keyframePath(const ReconstructionState& state);

/// Keyframes from `begin` on with their observations, without images; indices start at `begin`.
ReconstructionData lastPart(const ReconstructionData& data, int32_t begin);

/// Points triangulated from the last keyframes and their current poses, in the map. Takes milliseconds: for
/// displays while driving.
std::vector<Eigen::Vector3d> recentLandmarks(const ReconstructionState& state,
                                             const TriangulationOptions& options, int num_keyframes);

}  // namespace vcharge
