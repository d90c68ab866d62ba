#include <exception>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <nav_msgs/Path.h>
#include <nodelet/nodelet.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Trigger.h>
#include <vcharge_msgs/CalibrationStatus.h>
#include <visualization_msgs/MarkerArray.h>
#include <yaml-cpp/yaml.h>
#include <pluginlib/class_list_macros.hpp>

#include "calibration_messages.h"
#include "vcharge_calibration/rig_calibration_files.h"
#include "vcharge_calibration/rig_calibration_session.h"
#include "vcharge_core/sparse_map_file.h"
#include "vcharge_mapping/live_view.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {

/// Calibrates the extrinsics of a rig from a live or replayed drive as calibrate_rig does, and coaches the
/// driver: /calibration/status tells what to drive next, how well each camera's place is known, and when to
/// stop. Shows the drive on /calibration/trajectory, /calibration/landmarks (by camera) and
/// /calibration/cameras, in the frame `map`. Services: ~calibrate begins to calibrate by the drive so far and
/// returns; ~reset begins a new drive. Files are written after PASS and WARN, the report always. Parameters:
/// ~rig (path), ~output (rig.yaml to write), optional ~map (*.vmap), ~trajectory (*.tum), ~report (folder),
/// ~options (RigCalibratorOptions), ~session (RigCalibrationSessionOptions), ~source
/// (LiveDriveSourceOptions), ~lossless_replay (every image in order, as calibrate_rig; otherwise those that
/// wait too long are dropped).
class CalibrationNodelet : public nodelet::Nodelet {
 public:
  ~CalibrationNodelet() override {
    diagnostics_.clear();
    source_.reset();  // no callback any more
    session_.reset();
  }

 private:
  using Status = RigCalibrationSession::Status;
  using Response = std_srvs::TriggerResponse;

  void onInit() override {
    ros::NodeHandle& node = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    const std::string rig_path = requireStringParameter(private_node, "rig", "the path of a rig.yaml");
    const auto rig = std::make_shared<const CameraRig>(readCameraRig(rig_path));
    output_ = requireStringParameter(private_node, "output", "the path of the rig.yaml to write");
    private_node.param("map", map_, map_);
    private_node.param("trajectory", trajectory_, trajectory_);
    private_node.param("report", report_, report_);
    readFieldsFromParameters(private_node, "options", &options_);
    provenance_ = {{"rig", rig_path},
                   {"options", YAML::Dump(writeFields(options_))},
                   {"program", "calibration_nodelet 0.1.0"}};
    RigCalibrationSessionOptions session_options;
    readFieldsFromParameters(private_node, "session", &session_options);
    LiveDriveSourceOptions source_options;
    if (private_node.param("lossless_replay", false)) {
      source_options.takeEverything();
    }
    readFieldsFromParameters(private_node, "source", &source_options);
    source_ = std::make_unique<LiveDriveSource>(node, rig, source_options);
    session_ = std::make_unique<RigCalibrationSession>(
        rig, options_, session_options, [this](const Status& status) { publish(status); },
        [this](const MappingState& state, const CameraRig& guess) { watch(state, guess); },
        [this](const FinishedCalibration& work) { finish(work); });
    // Nothing throws any more: a nodelet that does not load must leave no publisher behind.
    status_publisher_ = node.advertise<vcharge_msgs::CalibrationStatus>("/calibration/status", 10, true);
    path_publisher_ = node.advertise<nav_msgs::Path>("/calibration/trajectory", 1, true);
    landmark_publisher_ = node.advertise<sensor_msgs::PointCloud2>("/calibration/landmarks", 1, true);
    camera_publisher_ = node.advertise<visualization_msgs::MarkerArray>("/calibration/cameras", 1, true);
    publish(session_->status());
    addDiagnostics("", [this] { return source_->report(); });
    addDiagnostics("/rig", [this] { return report(); });
    calibrate_ = advertiseTrigger(&private_node, "calibrate", &guard_,
                                  [this](Response* response) { calibrate(response); });
    reset_ =
        advertiseTrigger(&private_node, "reset", &guard_, [this](Response* response) { reset(response); });
    source_->run(session_.get(), DriveSource::ProgressCallback());
  }

  void addDiagnostics(const std::string& name, std::function<DriveMonitor::Report()> report) {
    diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(getMTNodeHandle(), getMTPrivateNodeHandle(),
                                                                getName() + name, std::move(report)));
  }

  void calibrate(Response* response) {
    source_->flush();
    response->success = session_->calibrate(&response->message) ? 1 : 0;
  }

  void reset(Response* response) {
    source_->flush();  // of the drive that is forgotten
    session_->reset();
    response->success = 1;
    response->message = "a new drive begins";
  }

  /// From the thread of the drive and that of the calibration.
  void publish(const Status& status) {
    vcharge_msgs::CalibrationStatus message = toStatusMessage(status);
    message.header.stamp = ros::Time::now();
    status_publisher_.publish(message);
  }

  void watch(const MappingState& state, const CameraRig& guess) {
    const Status status = session_->status();
    if (status.phase != RigCalibrationSession::Phase::kCalibrated) {  // what was found stays to be seen
      show(state, guess, status,
           recentLandmarksByCamera(state, guess, options_.triangulation, kShownKeyframes));
    }
  }

  void finish(const FinishedCalibration& work) {
    writeRigReport(report_, "Rig by a live drive", work.result, work.state, work.images);
    if (work.result.verdict != Verdict::kFail) {
      auto provenance = provenance_;
      provenance["verdict"] = toString(work.result.verdict);
      if (!map_.empty()) {
        writeSparseMap(*mapOfCalibration(options_, work.state), provenance, map_);
      }
      writeRigAndTrajectory(output_, trajectory_, work.result, work.state, provenance);
      Status status = session_->status();
      status.phase = RigCalibrationSession::Phase::kCalibrated;
      status.result = std::make_shared<const RigCalibration>(work.result);
      show(work.state, *work.result.rig, status, landmarksByCamera(work.state.data));
    }
  }

  void show(const MappingState& state, const CameraRig& rig, const Status& status,
            const LandmarksByCamera& landmarks) {
    landmark_publisher_.publish(toCloud(landmarks, kFrame));
    path_publisher_.publish(makePath(keyframePath(state), kFrame));
    camera_publisher_.publish(
        toCameraMarkers(rig, state.data.keyframes.back().map_from_vehicle, toStatusMessage(status), kFrame));
  }

  DriveMonitor::Report report() {
    const Status status = session_->status();
    DriveMonitor::Report report;
    const bool has_failed = status.phase == RigCalibrationSession::Phase::kFailed;
    report.level = has_failed ? DriveMonitor::Level::kError : DriveMonitor::Level::kOk;
    report.message = status.message;
    report.values.emplace_back("next", status.outlook.next);
    for (const auto& [name, count] : status.counts) {
      report.values.emplace_back(name, std::to_string(count));
    }
    return report;
  }

  static constexpr const char* kFrame = "map";
  static constexpr int kShownKeyframes = 20;
  RigCalibratorOptions options_;
  std::string output_, map_, trajectory_, report_;  // paths
  std::map<std::string, std::string> provenance_;
  CallbackGuard guard_{"calibration"};
  ros::Publisher status_publisher_, path_publisher_, landmark_publisher_, camera_publisher_;
  std::unique_ptr<RigCalibrationSession> session_;
  std::unique_ptr<LiveDriveSource> source_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
  ros::ServiceServer calibrate_, reset_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::CalibrationNodelet, nodelet::Nodelet)
