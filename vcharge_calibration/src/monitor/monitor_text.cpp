#include "vcharge_calibration/monitor/monitor_text.h"

#include <array>
#include <cmath>

#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kCentimetres = 100.0;
constexpr double kPercent = 100.0;

struct Axis {
  const char* name;
  double unit;
  const char* unit_name;
  int digits;
};

constexpr std::array<Axis, 6> kCameraAxes{{{"forwards", kCentimetres, "cm", 2},
                                           {"sideways", kCentimetres, "cm", 2},
                                           {"height", kCentimetres, "cm", 2},
                                           {"roll", kDegrees, "degrees", 3},
                                           {"pitch", kDegrees, "degrees", 3},
                                           {"yaw", kDegrees, "degrees", 3}}};
constexpr std::array<Axis, 3> kOdometerAxes{
    {{"distance", kPercent, "%", 2}, {"turn", kPercent, "%", 2}, {"turn per metre", kDegrees, "degrees", 3}}};

Axis axisOf(const RigChange& change) {
  const auto main = static_cast<size_t>(change.mainAxis());
  switch (change.part) {
    case RigPart::kOdometer:
      return kOdometerAxes.at(main);
    case RigPart::kBody:
      return kCameraAxes.at(main + 2);
    case RigPart::kCamera:
      break;
  }
  return kCameraAxes.at(main);
}

std::string subjectOf(const CameraRig& rig, const RigChange& change) {
  switch (change.part) {
    case RigPart::kOdometer:
      return "the odometer changed (a tyre?)";
    case RigPart::kBody:
      return "the body stands differently on its wheels (a load?)";
    case RigPart::kCamera:
      break;
  }
  return "camera " + rig.cameras[change.camera].name + (change.is_slow ? " moves on slowly" : " moved");
}

std::string describeSoftness(const PitchResponse& response) {
  return "soft suspension: the body pitches " + toText(kDegrees * response.radPerMetrePerS2(), 2) + " +- " +
         toText(kDegrees * response.sigma(), 2) + " degrees per m/s^2; up to 0.3 is usual";
}

}  // namespace

std::vector<std::string> deviationNames(const CameraRig& rig) {
  std::vector<std::string> names;
  for (const Axis& axis : kOdometerAxes) {
    names.push_back(std::string("odometer ") + axis.name);
  }
  for (const RigCamera& camera : rig.cameras) {
    for (const Axis& axis : kCameraAxes) {
      names.push_back(camera.name + " " + axis.name);
    }
  }
  return names;
}

std::string describeChange(const CameraRig& rig, const RigChange& change) {
  const Eigen::Index main = change.mainAxis();
  const Axis axis = axisOf(change);
  const std::string when =
      change.earliest_m > 0.0
          ? "between " + toText(change.earliest_m, 0) + " and " + toText(change.latest_m, 0) + " m"
          : "before the drive, or in its first " + toText(change.latest_m, 0) + " m";
  return subjectOf(rig, change) + ": " + axis.name + " by " +
         toText(axis.unit * change.size[main], axis.digits) + " +- " +
         toText(axis.unit * std::sqrt(change.covariance(main, main)), axis.digits) + " " + axis.unit_name +
         ", " + when;
}

MonitorVerdict judgeMonitoredDrive(const RigMonitor& monitor, const std::vector<std::string>& remarks) {
  MonitorVerdict verdict;
  double seen_m = 0.0;
  std::vector<double> dim_m(monitor.rig().cameras.size(), 0.0);
  std::vector<bool> sees_little(dim_m.size(), false);
  std::vector<double> dirt(dim_m.size(), 0.0);
  for (const MonitoredPart& part : monitor.parts()) {
    const double length_m = part.end_m - part.begin_m;
    seen_m += length_m;
    for (size_t i = 0; i < dim_m.size(); ++i) {
      dim_m[i] += part.sight[i] < kMinSight ? length_m : 0.0;
      sees_little[i] = sees_little[i] || part.sees_little[i];
      dirt[i] = part.is_dirty[i] ? std::max(dirt[i], part.dirt[i]) : dirt[i];
    }
  }
  if (!(seen_m > 0.0)) {
    verdict.remarks.emplace_back("the car did not move: nothing can be told about its rig");
    return verdict;
  }
  for (const RigChange& change : monitor.changes()) {
    verdict.remarks.push_back(describeChange(monitor.rig(), change));
  }
  for (size_t i = 0; i < dim_m.size(); ++i) {
    if (sees_little[i]) {
      verdict.remarks.push_back("camera " + monitor.rig().cameras[i].name + " saw little over " +
                                toText(dim_m[i], 0) + " m: its lens is dirty, covered or blinded");
    }
    if (dirt[i] > 0.0) {
      verdict.remarks.push_back("camera " + monitor.rig().cameras[i].name +
                                " has dirt on its lens: spots hide " + toText(100.0 * dirt[i], 1) +
                                " % of the ground that it sees");
    }
  }
  if (monitor.pitchResponse().isSoft()) {
    verdict.remarks.push_back(describeSoftness(monitor.pitchResponse()));
  }
  verdict.remarks.insert(verdict.remarks.end(), remarks.begin(), remarks.end());
  verdict.grade = verdict.remarks.empty() ? Verdict::kPass : Verdict::kWarn;
  return verdict;
}

}  // namespace vcharge
