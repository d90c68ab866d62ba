#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vcharge_msgs/TrackedObjects.h>
#include <pluginlib/class_list_macros.hpp>

#include "scheduled_sweeps.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/rig_health_conversions.h"
#include "vcharge_ros/stage_schedule.h"

namespace vcharge {

/// Computes range maps of a live or replayed drive, on the topics of RangeMapPublisher; while the vehicle
/// stands only with the option inter_camera. See ScheduledSweeps for what comes first; what is left out is
/// counted. Cameras that moved, after /calibration/health, are matched with their own images only. Reports
/// one status per camera in /diagnostics. Parameters: ~rig (path), ~options (RangeMapperOptions), ~source
/// (LiveDriveSourceOptions), ~processor_budget (see StageSchedule), ~lossless_replay (every image in order,
/// as compute_range_maps).
class DepthNodelet : public Nodelet, private DriveConsumer {
 public:
  DepthNodelet() : Nodelet("depth") {}
  ~DepthNodelet() override { end(); }

 private:
  void start() override {
    rig_ = readRig();
    RangeMapperOptions options;
    if (isLossless()) {
      options.frames.waitForEverything();
    }
    readOptions("options", &options);
    openSource(rig_, options.cameras);
    const double budget = processorBudget();
    // As many as the budget keeps busy: more of them hold up each other and the stages that follow.
    const auto num_threads = static_cast<size_t>(std::max(1.0, std::ceil(budget)));
    schedule_ = std::make_unique<StageSchedule>(*rig_, budget, num_threads);
    mapper_ = std::make_unique<RangeMapper>(rig_, options,
                                            [this](RangeTask task) { tasks_.push_back(std::move(task)); });
    sweeps_ = std::make_unique<ScheduledSweeps>(&node(), rig_, mapper_.get(), schedule_.get(), &guard(),
                                                isLossless());
    const std::vector<RangeMapperStatus> cameras = mapper_->status();
    for (size_t i = 0; i < cameras.size(); ++i) {
      addDiagnostics(
          "/" + cameras[i].camera_name, [this, i] { return report(mapper_->status().at(i)); }, Threads::kOne);
    }
    if (schedule_->hasLimit()) {
      subscribe<vcharge_msgs::TrackedObjects>(
          "/obstacles/objects", 1,
          [this](const vcharge_msgs::TrackedObjectsConstPtr& message) { schedule_->setObjects(*message); });
    }
    subscribe<vcharge_msgs::RigHealth>(kRigHealthTopic, 1,
                                       [this](const vcharge_msgs::RigHealthConstPtr& message) {
                                         if (const auto condition = fromMessage(*message, *rig_)) {
                                           mapper_->setCondition(*condition);
                                         }
                                       });
    runSource(this);
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    schedule_->run([&] { mapper_->addImage(camera_index, stamp, image); });
    sweeps_->push(&tasks_);
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    schedule_->setOdometry(odometry);
    schedule_->run([&] { mapper_->addOdometry(odometry); });
    sweeps_->push(&tasks_);
  }

  DriveMonitor::Report report(const RangeMapperStatus& status) const {
    const bool works =
        status.state == RangeMapperState::kMapping || status.state == RangeMapperState::kStanding;
    DriveMonitor::Report report;
    report.level = works && !status.has_moved ? DriveMonitor::Level::kOk : DriveMonitor::Level::kWarn;
    report.message = status.camera_name + ": " + status.message;
    if (status.has_moved) {
      report.message += "; it moved: its extrinsics must be repaired";
    }
    const auto add = [&](const std::string& key, uint64_t value) {
      report.values.emplace_back(key, std::to_string(value));
    };
    add("images", status.images);
    add("references", status.references);
    add("inter_camera", status.inter_camera);
    add("dropped", sweeps_->numDropped());
    add("standing", status.standing);
    add("without_pose", status.without_pose);
    add("without_neighbours", status.without_neighbours);
    add("ignored_images", status.ignored_images);
    add("restarts", status.resets);
    schedule_->describe(rig_->cameraIndex(status.camera_name), &report);
    addCounters(mapper_->counters(), &report);
    return report;
  }

  std::shared_ptr<const CameraRig> rig_;
  std::unique_ptr<StageSchedule> schedule_;
  std::vector<RangeTask> tasks_;  // emitted by the mapper
  std::unique_ptr<RangeMapper> mapper_;
  std::unique_ptr<ScheduledSweeps> sweeps_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::DepthNodelet, nodelet::Nodelet)
