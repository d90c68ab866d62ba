#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_calibration/monitor/monitor_text.h"
#include "vcharge_calibration/monitor/rig_repair.h"
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
  std::vector<std::string> bags;
  std::string rig, output, options, calibration;
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

/// What was repaired during the drives.
struct Repairs {
  std::vector<std::string> cameras, remarks;
};

nlohmann::json toJson(const RigMonitor& monitor, const MonitorVerdict& verdict, const Repairs& repairs) {
  nlohmann::json found = {{"verdict", toString(verdict.grade)},         {"remarks", verdict.remarks},
                          {"names", deviationNames(monitor.rig())},     {"repaired", repairs.cameras},
                          {"num_versions", monitor.adoptions().size()}, {"changes", nlohmann::json::array()}};
  for (const RigChange& change : monitor.changes()) {
    found["changes"].push_back(toJson(monitor.rig(), change));
  }
  if (!monitor.parts().empty()) {
    const MonitoredPart& now = monitor.parts().back();
    found["distance_m"] = now.end_m;
    found["pitch_response"] = {monitor.pitchResponse().radPerMetrePerS2(), monitor.pitchResponse().sigma()};
    found["deviation"] = toList(now.deviation);
    found["standard_deviations"] = toList(now.sigmas);
  }
  return found;
}

/// Watches one drive. Between two drives it is safe to go on from a repaired rig.
void watch(const Arguments& arguments, const std::string& bag, BagDriveSource* source, RigMonitor* monitor,
           Repairs* repairs) {
  {
    ProgressBar bar("following " + fs::path(bag).filename().string());
    source->run(monitor, [&](double fraction) { bar.update(fraction); });
    monitor->flush();
  }
  const RigRepair repair = repairRig(*monitor);
  repairs->remarks = repair.remarks;
  if (repair.rig != nullptr) {
    writeRepairedRig(
        *repair.rig,
        {{"bag", bag}, {"bag_hash", fileHash(bag)}, {"rig", arguments.rig}, {"program", "monitor_rig 0.1.0"}},
        (fs::path(arguments.output) / "rig.yaml").string());
    repairs->cameras.insert(repairs->cameras.end(), repair.cameras.begin(), repair.cameras.end());
    monitor->adopt(repair.rig);
  }
}

void monitorDrives(const Arguments& arguments, const RigMonitorOptions& options, nlohmann::json* found) {
  RigCalibratorOptions calibration;
  if (!arguments.calibration.empty()) {
    readFieldsFromFile(arguments.calibration, &calibration);
  }
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  RigMonitor monitor(rig, calibration, options, nullptr);
  BagDriveSourceOptions source_options;
  source_options.max_image_gap_s = INFINITY;  // frames that lack a camera are used
  std::vector<std::unique_ptr<BagDriveSource>> sources;
  for (const std::string& bag : arguments.bags) {
    sources.push_back(std::make_unique<BagDriveSource>(bag, rig, source_options));
  }
  std::vector<MonitoredDrive> drives;
  Repairs repairs;
  for (size_t i = 0; i < sources.size(); ++i) {
    const std::string& bag = arguments.bags[i];
    watch(arguments, bag, sources[i].get(), &monitor, &repairs);
    drives.push_back({fs::path(bag).filename().string(), monitor.travelled_m()});
  }
  const MonitorVerdict verdict = judgeMonitoredDrive(monitor, repairs.remarks);
  *found = toJson(monitor, verdict, repairs);
  writeMonitorFiles(arguments.output, drives, monitor, verdict);
  std::printf("%s\n", toString(verdict.grade).c_str());
  for (const std::string& remark : verdict.remarks) {
    std::printf("  %s\n", remark.c_str());
  }
  for (const std::string& camera : repairs.cameras) {
    std::printf("camera %s repaired in %s\n", camera.c_str(),
                (fs::path(arguments.output) / "rig.yaml").c_str());
  }
  if (verdict.grade == Verdict::kFail) {
    throw InputError(arguments.bags.front() + ": FAIL: " + verdict.remarks.front());
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Watches a rig during ordinary drives: how each camera and the odometer deviate from rig.yaml, what "
      "changed, when and by how much. Writes deviation.csv and monitor_report.html, and after a drive "
      "rig.yaml "
      "with the cameras that moved where they are now, once they are still and certain; the next drive is "
      "compared with it. Prints PASS, WARN with what changed, or FAIL.");
  Arguments arguments;
  app.addOption("--bag", &arguments.bags, "drives with images and /odom, one after the other").required();
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
      "repaired (names of cameras), num_versions (of the rig, that were written), "
      "pitch_response (radians per m/s^2, and its standard deviation).");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    RigMonitorOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::fputs(showOptions(options).c_str(), stdout);
      return;
    }
    monitorDrives(arguments, options, found);
  });
}
