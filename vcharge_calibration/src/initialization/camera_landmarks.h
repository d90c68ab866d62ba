#pragma once

#include <cstdint>

#include "vcharge_calibration/rig/rig_scene.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_reconstruction/mapping_data.h"
#include "vcharge_reconstruction/mapping_state.h"
#include "vcharge_reconstruction/triangulation.h"

namespace vcharge {

/// While driving: points that the last keyframes saw, by cameras whose places come from hand-eye and whose
/// heights these points tell; cameras without a place have none. Takes milliseconds.
LandmarksByCamera recentLandmarksByCamera(const MappingState& state, const CameraRig& guess,
                                          const TriangulationOptions& options, int num_keyframes);

}  // namespace vcharge
