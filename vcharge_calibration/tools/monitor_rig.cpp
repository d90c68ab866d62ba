#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_calibration/monitor/monitor_text.h"
#include "vcharge_calibration/report/monitor_files.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;
namespace fs = std::filesystem;

struct Arguments {
  std::string bag, rig, output, options, calibration;
  bool show_options = false;
};

std::vector<double> toList(const Eigen::VectorXd& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

std::string partName(RigPart part) {
  return part == RigPart::kCamera ? "camera" : part == RigPart::kOdometer ? "odometer" : "body";
}

nlohmann::json toJson(const CameraRig& rig, const RigChange& change) {
  nlohmann::json entry = {{"part", partName(change.part)},
                          {"text", describeChange(rig, change)},
                          {"is_slow", change.is_slow},
                          {"main_axis", change.mainAxis()},
                          {"size", toList(change.size)},
                          {"standard_deviations", toList(change.covariance.diagonal().cwiseSqrt())},
                          {"earliest_m", change.earliest_m},
                          {"latest_m", change.latest_m},
                          {"found_m", change.found_m},
                          {"log_probability", change.log_probability}};
  if (change.part == RigPart::kCamera) {
    entry["camera"] = rig.cameras[change.camera].name;
  }
  return entry;
}

nlohmann::json toJson(const RigMonitor& monitor, const MonitorVerdict& verdict, const RigRepair& repair) {
  nlohmann::json found = {{"verdict", toString(verdict.grade)},
                          {"remarks", verdict.remarks},
                          {"names", deviationNames(monitor.rig())},
                          {"repaired", repair.cameras},
                          {"changes", nlohmann::json::array()}};
  for (const RigChange& change : monitor.changes()) {
    found["changes"].push_back(toJson(monitor.rig(), change));
  }
  if (!monitor.parts().empty()) {
    const MonitoredPart& now = monitor.parts().back();
    found["distance_m"] = now.end_m;
    found["deviation"] = toList(now.deviation);
    found["standard_deviations"] = toList(now.sigmas);
  }
  return found;
}

void monitorDrive(const Arguments& arguments, const RigMonitorOptions& options, nlohmann::json* found) {
  RigCalibratorOptions calibration;
  if (!arguments.calibration.empty()) {
    readFieldsFromFile(arguments.calibration, &calibration);
  }
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  RigMonitor monitor(rig, calibration, options, nullptr);
  {
    ProgressBar bar("following the drive");
    BagDriveSourceOptions source_options;
    source_options.max_image_gap_s = INFINITY;  // frames that lack a camera are used
    BagDriveSource source(arguments.bag, rig, source_options);
    source.run(&monitor, [&](double fraction) { bar.update(fraction); });
    monitor.flush();
  }
  const RigRepair repair = repairRig(monitor);
  const MonitorVerdict verdict = judgeMonitoredDrive(monitor, repair);
  *found = toJson(monitor, verdict, repair);
  const fs::path folder(arguments.output);
  writeMonitorFiles(folder.string(), "Rig during " + fs::path(arguments.bag).filename().string(), monitor,
                    verdict);
  if (repair.rig != nullptr) {
    writeRepairedRig(monitor, repair,
                     {{"bag", arguments.bag},
                      {"bag_hash", fileHash(arguments.bag)},
                      {"rig", arguments.rig},
                      {"program", "monitor_rig 0.1.0"}},
                     (folder / "rig.yaml").string());
  }
  std::printf("%s\n", toString(verdict.grade).c_str());
  for (const std::string& remark : verdict.remarks) {
    std::printf("  %s\n", remark.c_str());
  }
  for (const std::string& camera : repair.cameras) {
    std::printf("camera %s repaired in %s\n", camera.c_str(), (folder / "rig.yaml").c_str());
  }
  if (verdict.grade == Verdict::kFail) {
    throw InputError(arguments.bag + ": FAIL: " + verdict.remarks.front());
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Watches a rig during an ordinary drive: how each camera and the odometer deviate from rig.yaml, what "
      "changed, when and by how much. Writes deviation.csv and monitor_report.html, and rig.yaml with the "
      "cameras that moved where they are now, once they are still and certain. Prints PASS, WARN with what "
      "changed, or FAIL.");
  Arguments arguments;
  app.addOption("--bag", &arguments.bag, "drive with images and /odom").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with extrinsics").required();
  app.addOption("--output", &arguments.output, "folder to write").required().check(requireOutputFolder);
  app.addOption("--options", &arguments.options, "YAML with overrides of RigMonitorOptions");
  app.addOption("--calibration-options", &arguments.calibration,
                "YAML with overrides of RigCalibratorOptions, for the adjustment of each part");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: verdict (PASS, WARN, FAIL), remarks, distance_m, names (of the deviations), "
      "deviation, "
      "standard_deviations (metres, radians; of the odometer: ratios, and radians per metre), changes (part, "
      "camera, text, is_slow, main_axis, size, standard_deviations, earliest_m, latest_m, found_m, "
      "log_probability), "
      "repaired (names of cameras).");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    RigMonitorOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::fputs(showOptions(options).c_str(), stdout);
      return;
    }
    monitorDrive(arguments, options, found);
  });
}
