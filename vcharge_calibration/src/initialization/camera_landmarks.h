#pragma once

#include <cstdint>

#include "vcharge_calibration/rig/rig_scene.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"
#include "vcharge_reconstruction/reconstruction_data.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Landmarks of the newest keyframes by camera, for displays. The extrinsics of `initial_rig` come from
/// hand-eye calibration, the heights from the points; cameras without extrinsics have no points. Takes
/// milliseconds.
LandmarksByCamera recentLandmarksByCamera(const ReconstructionState& state, const CameraRig& initial_rig,
                                          const TriangulationOptions& options, int num_keyframes);

}  // namespace vcharge
