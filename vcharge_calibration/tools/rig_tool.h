#pragma once

#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_reconstruction/stage_progress.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

// What the tools that calibrate a rig from a drive have in common.

struct RigToolArguments {
  std::string bag, rig, options, output, trajectory, report;
  bool show_options = false;
};

void addRigToolArguments(CLI::App* app, RigToolArguments* arguments);

/// The options of the file that was given, printed where that was asked for; otherwise calls `calibrate` with
/// them and their text.
template <class Options, class Calibrate>
void runWithOptions(const RigToolArguments& arguments, const Calibrate& calibrate) {
  Options options;
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  std::ostringstream text;
  text << writeFields(options);
  if (arguments.show_options) {
    std::printf("%s\n", text.str().c_str());
    return;
  }
  calibrate(options, text.str());
}

/// Feeds the bag with a progress bar.
void followDrive(const RigToolArguments& arguments, const std::shared_ptr<const CameraRig>& rig,
                 DriveConsumer* consumer);

/// Runs the calibration with a progress bar, prints what came out, and writes the report, with more sections
/// where there are some. InputError with the verdict's first reason where it is kFail.
RigCalibration finishAndPrint(const RigToolArguments& arguments, const MappingState& state,
                              const std::function<RigCalibration(const StageCallback&)>& finish,
                              const KeyframeImages& images,
                              const std::function<std::string()>& more_sections = nullptr);

/// What the rig and the map say of where they come from.
std::map<std::string, std::string> provenanceOf(const RigToolArguments& arguments, const std::string& program,
                                                const std::string& options, const RigCalibration& result);

}  // namespace vcharge
