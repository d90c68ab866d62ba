#pragma once

#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_state.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {

// Code shared by the tools that calibrate a rig from a drive.

struct RigToolArguments {
  std::string bag, rig, options, output, trajectory, report;
  bool show_options = false;
  nlohmann::json* found = nullptr;  ///< output of --json, filled by finishAndPrint()
};

void addRigToolArguments(CommandLine* app, RigToolArguments* arguments);

/// Reads the options, then prints them for --show-options, or calls `calibrate` with them and their text.
template <class Options, class Calibrate>
void runWithOptions(const RigToolArguments& arguments, const Calibrate& calibrate) {
  Options options;
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  std::ostringstream text;
  text << writeFields(options);
  if (arguments.show_options) {
    std::fputs(showOptions(options).c_str(), stdout);
    return;
  }
  calibrate(options, text.str());
}

/// Feeds the bag with a progress bar.
void followDrive(const RigToolArguments& arguments, const std::shared_ptr<const CameraRig>& rig,
                 DriveConsumer* consumer);

/// Runs the calibration with a progress bar, prints the result, and writes the report with `more_sections`.
/// For kFail, throws InputError with the verdict's first reason.
RigCalibration finishAndPrint(const RigToolArguments& arguments, const ReconstructionState& state,
                              const std::function<RigCalibration(const StageCallback&)>& finish,
                              const KeyframeImages& images,
                              const std::function<std::string()>& more_sections = nullptr);

/// Provenance of the written rig and map.
std::map<std::string, std::string> provenanceOf(const RigToolArguments& arguments, const std::string& program,
                                                const std::string& options, const RigCalibration& result);

/// Writes rig and trajectory, and prints where the rig went if not to --output (see writeRigAndTrajectory()).
void writeAndTell(const RigToolArguments& arguments, const RigCalibration& result,
                  const ReconstructionState& state, const std::map<std::string, std::string>& provenance);

}  // namespace vcharge
