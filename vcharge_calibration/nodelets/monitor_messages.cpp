#include "monitor_messages.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "vcharge_calibration/monitor/monitor_text.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;

template <class Array>
void copyTo(const Eigen::VectorXd& values, Array* array) {
  std::copy(values.data(), values.data() + values.size(), array->begin());
}

}  // namespace

vcharge_msgs::RigHealth toMessage(const RigMonitor& monitor) {
  const MonitoredPart& now = monitor.parts().back();
  vcharge_msgs::RigHealth message;
  message.header.stamp = fromTimestamp(now.end);
  message.header.frame_id = monitor.rig().vehicle_frame;
  message.distance_m = now.end_m;
  std::set<size_t> moved;
  for (const RigChange& change : monitor.openChanges()) {
    message.changes.push_back(describeChange(monitor.rig(), change));
    if (change.part == RigPart::kCamera) {
      moved.insert(change.camera);
    }
  }
  for (size_t i = 0; i < monitor.rig().cameras.size(); ++i) {
    vcharge_msgs::CameraHealth camera;
    camera.camera = monitor.rig().cameras[i].name;
    camera.state = moved.count(i) > 0   ? camera.MOVED
                   : now.sees_little[i] ? camera.SEES_LITTLE
                   : now.is_dirty[i]    ? camera.DIRTY
                                        : camera.OK;
    camera.sight = now.sight[i];
    camera.dirt = now.dirt[i];
    camera.vehicle_from_camera = toTransformMessage(*monitor.rig().cameras[i].vehicle_from_camera);
    copyTo(now.deviation.segment<6>(RigDeviation::rowOf(i)), &camera.deviation);
    copyTo(now.sigmas.segment<6>(RigDeviation::rowOf(i)), &camera.standard_deviations);
    message.cameras.push_back(camera);
  }
  copyTo(now.deviation.head<RigDeviation::kOdometerSize>(), &message.odometer);
  copyTo(now.sigmas.head<RigDeviation::kOdometerSize>(), &message.odometer_standard_deviations);
  message.pitch_response = monitor.pitchResponse().radPerMetrePerS2();
  message.pitch_response_standard_deviation = monitor.pitchResponse().sigma();
  message.is_soft = static_cast<uint8_t>(monitor.pitchResponse().isSoft());
  return message;
}

DriveMonitor::Report toReport(const vcharge_msgs::RigHealth& health) {
  DriveMonitor::Report report;
  report.level = DriveMonitor::Level::kOk;
  report.message =
      health.cameras.empty() ? "waiting for the first part of the drive" : "the rig is as calibrated";
  if (health.is_soft != 0) {
    report.level = DriveMonitor::Level::kWarn;
    report.message = "soft suspension: the body pitches far when it speeds up or brakes";
  }
  for (const std::string& change : health.changes) {
    report.level = DriveMonitor::Level::kWarn;
    report.message = change;  // the last one
  }
  for (const vcharge_msgs::CameraHealth& camera : health.cameras) {
    if (camera.state == camera.SEES_LITTLE) {
      report.level = DriveMonitor::Level::kWarn;
      report.message = "camera " + camera.camera + " sees little: its lens is dirty, covered or blinded";
    }
    if (camera.state == camera.DIRTY) {
      report.level = DriveMonitor::Level::kWarn;
      report.message = "camera " + camera.camera + " has dirt on its lens";
    }
    const double turn_rad = std::hypot(camera.deviation[3], camera.deviation[4], camera.deviation[5]);
    const double shift_m = std::hypot(camera.deviation[0], camera.deviation[1], camera.deviation[2]);
    report.values.emplace_back(camera.camera, toText(kDegrees * turn_rad, 3) + " degrees, " +
                                                  toText(100.0 * shift_m, 1) + " cm from the rig, sight " +
                                                  toText(camera.sight, 2));
  }
  report.values.emplace_back("driven (m)", toText(health.distance_m, 0));
  return report;
}

}  // namespace vcharge
