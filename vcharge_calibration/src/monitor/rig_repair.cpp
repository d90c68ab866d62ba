#include "vcharge_calibration/monitor/rig_repair.h"

#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "vcharge_calibration/monitor/monitor_text.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
/// Distance that a camera was still.
constexpr double kMinStill_m = 20.0;
// A repaired camera is at least this certain, per axis.
constexpr double kMaxSigma_m = 0.02;
constexpr double kMaxSigma_rad = 0.001;

/// What is known of a repaired rig: its version (a calibrated one is the first), and what showed that it was
/// needed.
std::map<std::string, std::string> provenanceOf(const RigMonitor& monitor) {
  const std::map<std::string, std::string>& before = monitor.rig().provenance;
  const auto version = before.find("version");
  std::string evidence;
  for (const RigChange& change : monitor.openChanges()) {
    evidence += (evidence.empty() ? "" : "; ") + describeChange(monitor.rig(), change);
  }
  return {{"version", std::to_string(version == before.end() ? 2 : std::atoi(version->second.c_str()) + 1)},
          {"evidence", evidence}};
}

}  // namespace

RigRepair repairRig(const RigMonitor& monitor) {
  RigRepair repair;
  std::set<size_t> cameras;
  double last_m = 0.0;
  for (const RigChange& change : monitor.openChanges()) {
    if (change.part == RigPart::kCamera) {
      cameras.insert(change.camera);
      last_m = change.latest_m;
    }
  }
  if (cameras.empty()) {
    return repair;
  }
  const MonitoredPart& now = monitor.parts().back();
  const double still_m = now.end_m - last_m;
  if (still_m < kMinStill_m) {
    repair.remarks.push_back("a camera moved " + toText(still_m, 0) + " m ago: drive " +
                             toText(kMinStill_m - still_m, 0) + " m more for its repair");
    return repair;
  }
  const Eigen::MatrixXd covariance = monitor.covariance();
  auto rig = std::make_shared<CameraRig>(monitor.rig());
  for (const size_t i : cameras) {
    RigCamera& camera = rig->cameras[i];
    const Eigen::Index row = RigDeviation::rowOf(i);
    const double sigma_m = now.sigmas.segment<3>(row).maxCoeff();
    const double sigma_rad = now.sigmas.segment<3>(row + 3).maxCoeff();
    if (sigma_m > kMaxSigma_m || sigma_rad > kMaxSigma_rad) {
      repair.remarks.push_back("camera " + camera.name + " moved, but is known only within " +
                               toText(100.0 * sigma_m, 1) + " cm and " + toText(kDegrees * sigma_rad, 3) +
                               " degrees: drive turns to both sides for its repair");
      continue;
    }
    camera.vehicle_from_camera = moved(*camera.vehicle_from_camera, now.deviation.segment<6>(row));
    camera.covariance = covariance.block<6, 6>(row, row);
    repair.cameras.push_back(camera.name);
  }
  if (!repair.cameras.empty()) {
    rig->provenance = provenanceOf(monitor);
    repair.rig = rig;
  }
  return repair;
}

}  // namespace vcharge
