#pragma once

#include <map>
#include <string>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Writes rig_report.html (see makeRigReport()) into a folder, which is made; an empty one: nowhere.
void writeRigReport(const std::string& folder, const std::string& title, const RigCalibration& result,
                    const MappingState& state, const KeyframeImages& images,
                    const std::string& more_sections = "");

/// Writes trajectory (*.tum, where not empty) and rig.yaml, the rig last, each atomically. InputError names
/// what cannot be written. Not after kFail.
void writeRigAndTrajectory(const std::string& rig_file, const std::string& trajectory_file,
                           const RigCalibration& result, const MappingState& state,
                           const std::map<std::string, std::string>& provenance);

}  // namespace vcharge
