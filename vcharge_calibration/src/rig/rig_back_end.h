#pragma once

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"
#include "vcharge_reconstruction/stage_progress.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Calibrates by a drive that was followed; `state` has the rig, poses and landmarks in the end.
RigCalibration runRigBackEnd(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                             const StageCallback& progress, MappingState* state);

}  // namespace vcharge
