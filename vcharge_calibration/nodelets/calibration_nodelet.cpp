#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <std_srvs/Trigger.h>
#include <yaml-cpp/yaml.h>
#include <pluginlib/class_list_macros.hpp>

#include "calibration_display.h"
#include "vcharge_calibration/live/rig_calibration_session.h"
#include "vcharge_calibration/report/rig_calibration_files.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

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
class CalibrationNodelet : public Nodelet {
 public:
  ~CalibrationNodelet() override {
    diagnostics_.clear();
    source_.reset();  // no callback any more
    session_.reset();
  }

 private:
  using Status = RigCalibrationSession::Status;
  using Response = std_srvs::TriggerResponse;

  void initialize() override {
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
        rig, options_, session_options, [this](const Status& status) { display_->tell(status); },
        [this](const ReconstructionState& state, const CameraRig& guess) { watch(state, guess); },
        [this](const FinishedCalibration& work) { finish(work); });
    // Nothing throws any more: a nodelet that does not load must leave no publisher behind.
    display_ = std::make_unique<CalibrationDisplay>(&node, options_);
    display_->tell(session_->status());
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

  void watch(const ReconstructionState& state, const CameraRig& guess) {
    const Status status = session_->status();
    if (status.phase != RigCalibrationSession::Phase::kCalibrated) {  // what was found stays to be seen
      display_->showDrive(status, state, guess);
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
      display_->showResult(session_->status(), work);
    }
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

  RigCalibratorOptions options_;
  std::string output_, map_, trajectory_, report_;  // paths
  std::map<std::string, std::string> provenance_;
  CallbackGuard guard_{"calibration"};
  std::unique_ptr<CalibrationDisplay> display_;
  std::unique_ptr<RigCalibrationSession> session_;
  std::unique_ptr<LiveDriveSource> source_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
  ros::ServiceServer calibrate_, reset_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::CalibrationNodelet, nodelet::Nodelet)
