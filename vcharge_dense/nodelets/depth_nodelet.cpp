#include <map>
#include <memory>
#include <string>
#include <utility>

#include <pluginlib/class_list_macros.hpp>

#include "range_map_publisher.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_ros/live_queue.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Computes range maps of a live or replayed drive, on the topics of RangeMapPublisher; while the vehicle
/// stands only with the option inter_camera. Reports one status per camera in /diagnostics. Parameters: ~rig
/// (path), ~options (RangeMapperOptions), ~source (LiveDriveSourceOptions), ~lossless_replay (every image in
/// order, as compute_range_maps; otherwise the newest first, and drops are counted).
class DepthNodelet : public Nodelet {
 public:
  DepthNodelet() : Nodelet("depth") {}
  ~DepthNodelet() override { end(); }

 private:
  static constexpr uint32_t kQueueSize = 10;  // 0 would mean that nothing is ever dropped

  void start() override {
    rig_ = readRig();
    RangeMapperOptions options;
    if (isLossless()) {
      options.frames.waitForEverything();
    }
    readOptions("options", &options);
    openSource(rig_, options.cameras);
    queue_ = std::make_unique<LiveQueue<RangeTask>>(
        isLossless(), [this](const RangeTask& task) { guard().run([&] { sweep(task); }); });
    mapper_ = std::make_unique<RangeMapper>(rig_, options, [this](RangeTask task) {
      const size_t camera_index = task.camera_index;
      queue_->push(camera_index, std::move(task));
    });
    const std::vector<RangeMapperStatus> cameras = mapper_->status();
    for (size_t i = 0; i < cameras.size(); ++i) {
      const size_t index = rig_->cameraIndex(cameras[i].camera_name);
      publishers_.try_emplace(index, &node(), rig_->cameras[index], isLossless() ? 0 : kQueueSize);
      addDiagnostics(
          "/" + cameras[i].camera_name, [this, i] { return report(mapper_->status().at(i)); }, Threads::kOne);
    }
    runSource(mapper_.get());
  }

  void sweep(const RangeTask& task) { publishers_.at(task.camera_index).publish(mapper_->sweep(task)); }

  DriveMonitor::Report report(const RangeMapperStatus& status) const {
    const bool works =
        status.state == RangeMapperState::kMapping || status.state == RangeMapperState::kStanding;
    DriveMonitor::Report report;
    report.level = works ? DriveMonitor::Level::kOk : DriveMonitor::Level::kWarn;
    report.message = status.camera_name + ": " + status.message;
    const auto add = [&](const std::string& key, uint64_t value) {
      report.values.emplace_back(key, std::to_string(value));
    };
    add("images", status.images);
    add("references", status.references);
    add("inter_camera", status.inter_camera);
    add("dropped", queue_->numDropped(rig_->cameraIndex(status.camera_name)));
    add("standing", status.standing);
    add("without_pose", status.without_pose);
    add("without_neighbours", status.without_neighbours);
    add("ignored_images", status.ignored_images);
    add("restarts", status.resets);
    addCounters(mapper_->counters(), &report);
    return report;
  }

  std::shared_ptr<const CameraRig> rig_;
  std::map<size_t, RangeMapPublisher> publishers_;  // key: index of the camera
  std::unique_ptr<RangeMapper> mapper_;
  std::unique_ptr<LiveQueue<RangeTask>> queue_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::DepthNodelet, nodelet::Nodelet)
