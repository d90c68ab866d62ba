#include <map>
#include <memory>
#include <string>

#include <yaml-cpp/yaml.h>
#include <pluginlib/class_list_macros.hpp>

#include "calibration_display.h"
#include "vcharge_calibration/live/rig_calibration_session.h"
#include "vcharge_calibration/report/rig_calibration_files.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_reconstruction/tiled_map.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Calibrates the extrinsics of a rig from a live or replayed drive as calibrate_rig does, and coaches the
/// driver: /calibration/status says what to drive next, how well each camera's extrinsics are known, and when
/// to stop. Shows the drive on /calibration/trajectory, /calibration/landmarks (by camera) and
/// /calibration/cameras, in the frame `map`. Services: ~calibrate starts to calibrate the drive so far and
/// returns; ~reset begins a new drive. Files are written after PASS and WARN, the report always; a rig that
/// passed stays if the new one has a WARN, as the status says. Parameters: ~rig (path), ~output (rig.yaml to
/// write), optional ~map (*.vmap), ~trajectory (*.tum), ~report (folder), ~options (RigCalibratorOptions),
/// ~session (RigCalibrationSessionOptions), ~source (LiveDriveSourceOptions), ~lossless_replay (every
/// image in order, as calibrate_rig; otherwise those that wait too long are dropped).
class CalibrationNodelet : public Nodelet {
 public:
  CalibrationNodelet() : Nodelet("calibration") {}
  ~CalibrationNodelet() override {
    end();
    session_.reset();  // first: its thread publishes
  }

 private:
  using Phase = RigCalibrationSession::Phase;
  using Status = RigCalibrationSession::Status;
  using Response = std_srvs::TriggerResponse;

  void start() override {
    const std::shared_ptr<const CameraRig> rig = readRig();
    output_ = requireParameter("output", "the path of the rig.yaml to write");
    map_ = parameter<std::string>("map", "");
    trajectory_ = parameter<std::string>("trajectory", "");
    report_ = parameter<std::string>("report", "");
    readOptions("options", &options_);
    provenance_ = {{"rig", parameter<std::string>("rig", "")},
                   {"options", YAML::Dump(writeFields(options_))},
                   {"program", "calibration_nodelet 0.1.0"}};
    RigCalibrationSessionOptions session_options;
    readOptions("session", &session_options);
    openSource(rig);
    session_ = std::make_unique<RigCalibrationSession>(
        rig, options_, session_options, [this](const Status& status) { display_->tell(status); },
        [this](const ReconstructionState& state, const CameraRig& initial_rig) { watch(state, initial_rig); },
        [this](const FinishedCalibration& work) { return finish(work); });
    display_ = std::make_unique<CalibrationDisplay>(&node(), options_);
    display_->tell(session_->status());
    addDiagnostics(
        "/rig", [this] { return report(); }, Threads::kSeveral);
    serve("calibrate", [this](Response* response) { calibrate(response); });
    serve("reset", [this](Response* response) { reset(response); });
    runSource(session_.get());
  }

  void calibrate(Response* response) {
    flushSource();
    response->success = session_->calibrate(&response->message) ? 1 : 0;
  }

  void reset(Response* response) {
    flushSource();  // frames left in the source belong to the previous drive
    session_->reset();
    response->success = 1;
    response->message = "a new drive begins";
  }

  void watch(const ReconstructionState& state, const CameraRig& initial_rig) {
    if (const Status status = session_->status(); status.phase != Phase::kCalibrated) {
      display_->showDrive(status, state, initial_rig);
    }
  }

  std::string finish(const FinishedCalibration& work) {
    writeRigReport(report_, "Rig by a live drive", work.result, work.state, work.images);
    if (work.result.verdict == Verdict::kFail) {
      return "";
    }
    provenance_["verdict"] = toString(work.result.verdict);
    if (!map_.empty()) {
      const std::shared_ptr<const SparseMap> map = mapOfCalibration(options_, work.state);
      writeSparseMap(*map, provenance_, map_, indexForTiles(*map));
    }
    const auto written = writeRigAndTrajectory(output_, trajectory_, work.result, work.state, provenance_);
    display_->showResult(session_->status(), work);
    return written == output_ ? "" : describeKept(output_, written);
  }

  DriveMonitor::Report report() {
    const Status status = session_->status();
    DriveMonitor::Report report;
    report.level = status.phase == Phase::kFailed ? DriveMonitor::Level::kError : DriveMonitor::Level::kOk;
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
  std::unique_ptr<CalibrationDisplay> display_;
  std::unique_ptr<RigCalibrationSession> session_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::CalibrationNodelet, nodelet::Nodelet)
