#pragma once

#include <map>
#include <string>

#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// The name of a file with a suffix before its extension.
std::string fileBeside(const std::string& path, const std::string& suffix);

/// Writes rig_report.html (see makeRigReport()) into a folder, which is created. An empty name: no report.
void writeRigReport(const std::string& folder, const std::string& title, const RigCalibration& result,
                    const ReconstructionState& state, const KeyframeImages& images,
                    const std::string& more_sections = "");

/// Writes rig.yaml and its masks, whose folders are created, with this provenance.
void writeRigWithMasks(CameraRig rig, std::map<std::string, std::string> provenance, const std::string& path);

/// Writes the trajectory (*.tum, unless empty), then rig.yaml, each atomically, and returns the rig's file: a
/// rig that passed is not replaced by one with the verdict WARN, which becomes `<name>_WARN.yaml` beside it.
/// InputError names a file that cannot be written. Must not be called for kFail.
std::string writeRigAndTrajectory(const std::string& rig_file, const std::string& trajectory_file,
                                  const RigCalibration& result, const ReconstructionState& state,
                                  const std::map<std::string, std::string>& provenance);
/// Says that `rig_file` stays, and which file was written instead.
std::string describeKept(const std::string& rig_file, const std::string& written);

}  // namespace vcharge
