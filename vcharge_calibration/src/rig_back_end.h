#pragma once

#include "vcharge_calibration/keyframe_images.h"
#include "vcharge_calibration/rig_calibration.h"
#include "vcharge_calibration/rig_calibrator_options.h"
#include "vcharge_mapping/map_back_end.h"
#include "vcharge_mapping/mapping_state.h"

namespace vcharge {

/// Calibrates by a drive that was followed; `state` has the rig, poses and landmarks in the end.
RigCalibration runRigBackEnd(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                             const StageCallback& progress, MappingState* state);

}  // namespace vcharge
