#include "rig_tool.h"

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "vcharge_calibration/report/rig_calibration_files.h"
#include "vcharge_calibration/rig/rig_calibration_text.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace vcharge {

void addRigToolArguments(CLI::App* app, RigToolArguments* arguments) {
  app->add_option("--bag", arguments->bag, "drive with images and /odom")->required();
  app->add_option("--rig", arguments->rig, "rig.yaml with intrinsics; its extrinsics are ignored")
      ->required();
  app->add_option("--output", arguments->output, "rig.yaml to write")->required()->check(requireNotEmpty);
  app->add_option("--trajectory", arguments->trajectory, "poses of all frames to write (.tum)")
      ->check(requireNotEmpty);
  app->add_option("--report", arguments->report, "folder for rig_report.html")->check(requireNotEmpty);
  app->add_option("--options", arguments->options, "YAML with options of the calibration");
  app->add_flag("--show-options", arguments->show_options,
                "print all options with their values, and do nothing else");
}

void followDrive(const RigToolArguments& arguments, const std::shared_ptr<const CameraRig>& rig,
                 DriveConsumer* consumer) {
  ProgressBar bar("following the drive");
  BagDriveSourceOptions options;
  options.max_image_gap_s = INFINITY;  // frames without a camera are used and counted
  BagDriveSource source(arguments.bag, rig, options);
  source.run(consumer, [&](double fraction) { bar.update(fraction); });
}

RigCalibration finishAndPrint(const RigToolArguments& arguments, const ReconstructionState& state,
                              const std::function<RigCalibration(const StageCallback&)>& finish,
                              const KeyframeImages& images,
                              const std::function<std::string()>& more_sections) {
  RigCalibration result;
  {
    ProgressBar bar("calibrating");
    result = finish([&](const StageProgress& progress) {
      bar.update((progress.number - 1 + progress.fraction) / progress.num_stages);
    });
  }
  std::printf("%s", describeCalibration(result).c_str());
  for (const auto& [stage, seconds] : state.report.stage_s) {
    std::printf("%s %.1f s; ", stage.c_str(), seconds);
  }
  std::printf("\n%s\n", toString(result.verdict).c_str());
  for (const std::string& remark : result.remarks) {
    std::printf("  %s\n", remark.c_str());
  }
  writeRigReport(arguments.report, "Rig by " + std::filesystem::path(arguments.bag).filename().string(),
                 result, state, images, more_sections ? more_sections() : "");
  if (result.verdict == Verdict::kFail) {
    throw InputError(arguments.bag + ": FAIL: " + result.remarks.front());
  }
  return result;
}

std::map<std::string, std::string> provenanceOf(const RigToolArguments& arguments, const std::string& program,
                                                const std::string& options, const RigCalibration& result) {
  return {{"bag", arguments.bag}, {"bag_hash", fileHash(arguments.bag)}, {"rig", arguments.rig},
          {"options", options},   {"verdict", toString(result.verdict)}, {"program", program + " 0.1.0"}};
}

}  // namespace vcharge
