#include "rig_tool.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "vcharge_calibration/report/rig_calibration_files.h"
#include "vcharge_calibration/rig/rig_calibration_text.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace vcharge {

void addRigToolArguments(CommandLine* app, RigToolArguments* arguments) {
  app->addOption("--bag", &arguments->bag, "drive with images and /odom").required();
  app->addOption("--rig", &arguments->rig, "rig.yaml with intrinsics; its extrinsics are ignored").required();
  app->addOption("--output", &arguments->output, "rig.yaml to write").required().check(requireOutput);
  app->addOption("--trajectory", &arguments->trajectory, "poses of all frames to write (.tum)")
      .check(requireOutput);
  app->addOption("--report", &arguments->report, "folder for rig_report.html").check(requireOutputFolder);
  app->addOption("--options", &arguments->options, "YAML with options of the calibration");
  addShowOptions(app, &arguments->show_options);
  app->setFooter(
      "Keys of --json: verdict (PASS, WARN, FAIL), remarks, distance_m, left_turn_rad, right_turn_rad, "
      "num_keyframes, num_landmarks, num_loop_edges, rms_px (per coordinate), odometer_turn_scale, "
      "time_offset_s, time_offset_sigma_s, cameras (name, num_observations, rms_px, standard_deviations of "
      "translation and rotation in the vehicle frame, travel_in_camera and up_in_camera as unit vectors "
      "where "
      "known, image_deviation: of the focal length's logarithm and the principal point, timing), stage_s "
      "(wall time), rig (the file that was written).");
}

void followDrive(const RigToolArguments& arguments, const std::shared_ptr<const CameraRig>& rig,
                 DriveConsumer* consumer) {
  ProgressBar bar("following the drive");
  BagDriveSourceOptions options;
  options.max_image_gap_s = INFINITY;  // frames that lack a camera are used, and counted
  BagDriveSource source(arguments.bag, rig, options);
  source.run(consumer, [&](double fraction) { bar.update(fraction); });
}

namespace {

nlohmann::json toJson(const Eigen::VectorXd& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

nlohmann::json toJson(const RigCalibration& result, const std::map<std::string, double>& stage_s) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const CameraCalibration& camera : result.cameras) {
    nlohmann::json entry = {
        {"name", camera.name},
        {"num_observations", camera.num_observations},
        {"rms_px", camera.rms_px},
        {"standard_deviations", toJson(camera.covariance.diagonal().cwiseMax(0.0).cwiseSqrt())}};
    if (camera.intrinsics) {
      entry["image_deviation"] = {{"values", toJson(camera.intrinsics->deviation)},
                                  {"standard_deviations", toJson(camera.intrinsics->sigmas)},
                                  {"is_corrected", camera.intrinsics->is_corrected}};
    }
    if (camera.timing) {
      const ImageTiming found = camera.timing->found.normalized();
      entry["timing"] = {
          {"readout_s", found.readout_s},
          {"readout_direction", enumNames<ReadoutDirection>()[static_cast<size_t>(found.readout_direction)]},
          {"clock_offset_s", found.clock_offset_s},
          {"standard_deviations", toJson(camera.timing->sigmas)},
          {"is_corrected", camera.timing->is_corrected}};
    }
    if (camera.initial.travel_in_camera.norm() > 0.0) {
      entry["travel_in_camera"] = toJson(camera.initial.travel_in_camera);
    }
    if (camera.up_in_camera.norm() > 0.0) {
      entry["up_in_camera"] = toJson(camera.up_in_camera);
    }
    cameras.push_back(entry);
  }
  return {{"verdict", toString(result.verdict)},
          {"remarks", result.remarks},
          {"distance_m", result.distance_m},
          {"left_turn_rad", result.left_turn_rad},
          {"right_turn_rad", result.right_turn_rad},
          {"num_keyframes", result.num_keyframes},
          {"num_landmarks", result.num_landmarks},
          {"num_loop_edges", result.num_loop_edges},
          {"rms_px", result.rms_px},
          {"odometer_turn_scale", result.odometer_turn_scale},
          {"time_offset_s", result.time_offset_s},
          {"time_offset_sigma_s", result.time_offset_sigma_s},
          {"cameras", cameras},
          {"stage_s", stage_s}};
}

}  // namespace

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
  if (arguments.found != nullptr) {
    *arguments.found = toJson(result, state.report.stage_s);
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

void writeAndTell(const RigToolArguments& arguments, const RigCalibration& result,
                  const ReconstructionState& state, const std::map<std::string, std::string>& provenance) {
  const std::string written =
      writeRigAndTrajectory(arguments.output, arguments.trajectory, result, state, provenance);
  if (written != arguments.output) {
    std::printf("  %s\n", describeKept(arguments.output, written).c_str());
  }
  if (arguments.found != nullptr) {
    (*arguments.found)["rig"] = written;
  }
}

}  // namespace vcharge
