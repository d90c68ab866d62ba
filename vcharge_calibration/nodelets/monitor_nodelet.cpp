#include <memory>
#include <mutex>
#include <string>

#include <pluginlib/class_list_macros.hpp>

#include "monitor_messages.h"
#include "vcharge_calibration/monitor/rig_repair.h"
#include "vcharge_calibration/report/monitor_files.h"
#include "vcharge_core/base/error.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/rig_health_conversions.h"

namespace vcharge {

/// Watches a rig during a live or replayed drive as monitor_rig does, and publishes how the car deviates from
/// it on /calibration/health after each part of the drive. The service ~repair writes the rig with the
/// cameras that moved where they are now, and goes on from it. localization_nodelet takes it with its
/// ~reload, other nodelets when they are started. Parameters: ~rig (path), ~output (rig.yaml to write),
/// ~options (RigMonitorOptions), ~calibration (RigCalibratorOptions), ~source (LiveDriveSourceOptions),
/// ~lossless_replay (every image in order, as monitor_rig).
class MonitorNodelet : public Nodelet {
 public:
  MonitorNodelet() : Nodelet("monitor") {}
  ~MonitorNodelet() override { end(); }

 private:
  void start() override {
    rig_path_ = requireParameter("rig", "the path of a rig.yaml with extrinsics");
    const std::shared_ptr<const CameraRig> rig = readRig();
    output_ = requireParameter("output", "the path of the rig.yaml to write");
    RigMonitorOptions options;
    readOptions("options", &options);
    RigCalibratorOptions calibration;
    readOptions("calibration", &calibration);
    openSource(rig);
    publisher_ = advertiseLatched<vcharge_msgs::RigHealth>(kRigHealthTopic);
    monitor_ =
        std::make_unique<RigMonitor>(rig, calibration, options, [this](const MonitoredPart&) { publish(); });
    addDiagnostics(
        "/rig", [this] { return report(); }, Threads::kSeveral);
    serve("repair", [this](std_srvs::TriggerResponse* response) { repair(response); });
    runSource(monitor_.get());
  }

  void publish() {
    const vcharge_msgs::RigHealth health = toMessage(*monitor_);
    publisher_.publish(health);
    const std::lock_guard<std::mutex> lock(mutex_);
    health_ = health;
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return toReport(health_);
  }

  void repair(std_srvs::TriggerResponse* response) {
    flushSource();
    monitor_->flush();
    const RigRepair repair = repairRig(*monitor_);
    if (repair.rig == nullptr) {
      response->success = 0;
      response->message = repair.remarks.empty() ? "no camera moved" : repair.remarks.front();
      return;
    }
    writeRepairedRig(*repair.rig, {{"rig", rig_path_}, {"program", "monitor_nodelet 0.1.0"}}, output_);
    monitor_->adopt(repair.rig);
    response->success = 1;
    response->message = output_ + ": repaired";
    for (const std::string& camera : repair.cameras) {
      response->message += " " + camera;
    }
  }

  std::string rig_path_, output_;
  ros::Publisher publisher_;
  std::unique_ptr<RigMonitor> monitor_;
  std::mutex mutex_;
  vcharge_msgs::RigHealth health_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MonitorNodelet, nodelet::Nodelet)
