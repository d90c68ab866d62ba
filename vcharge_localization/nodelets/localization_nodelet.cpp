#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <pluginlib/class_list_macros.hpp>

#include "localization_messages.h"
#include "localization_report.h"
#include "localization_topics.h"
#include "vcharge_core/base/error.h"
#include "vcharge_localization/drive_localizer.h"
#include "vcharge_ros/live_queue.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/rig_health_conversions.h"

namespace vcharge {

/// Localizes a live or replayed drive in a map and publishes what LocalizationTopics says, and a status in
/// /diagnostics; /initialpose sets a prior pose; /calibration/health tells which cameras moved and are left
/// out; the service ~reload goes on with the newest versions of the map and of the rig. Parameters: ~rig,
/// ~map (paths), ~options (DriveLocalizerOptions), ~source (LiveDriveSourceOptions), ~map_frame, ~odom_frame,
/// ~lossless_replay (every frame in order, as localize_drive; otherwise the newest first, and drops are
/// counted).
class LocalizationNodelet : public Nodelet {
 public:
  LocalizationNodelet() : Nodelet("localization") {}
  ~LocalizationNodelet() override { end(); }

 private:
  using InitialPose = geometry_msgs::PoseWithCovarianceStamped;

  void start() override {
    rig_ = readRigWithExtrinsics();
    map_frame_ = parameter("map_frame", map_frame_);
    if (isLossless()) {
      options_.frames.waitForEverything();
    }
    readOptions("options", &options_);
    openSource(rig_);
    localizer_ = openMap(rig_);

    topics_ = std::make_unique<LocalizationTopics>(&node(), map_frame_,
                                                   parameter("odom_frame", std::string("odom")));
    queue_ = std::make_unique<LiveQueue<ImageFrame>>(
        isLossless(), [this](const ImageFrame& frame) { guard().run([&] { localize(frame); }); });
    assembler_ = std::make_unique<ImageFrameAssembler>(
        rig_->cameras.size(), options_.frames,
        [this](ImageFrame frame) { queue_->push(0, std::move(frame)); });
    assembler_->joinStamps(rig_->stamp_tolerance_s);
    addDiagnostics(
        "/pose", [this] { return report_.report(queue_->numDropped(0), assembler_->counters()); },
        Threads::kOne);
    subscribe<InitialPose>("/initialpose", 1,
                           [this](const InitialPose::ConstPtr& message) { seed(*message); });
    subscribe<vcharge_msgs::RigHealth>(
        kRigHealthTopic, 1, [this](const vcharge_msgs::RigHealth::ConstPtr& message) { heed(*message); });
    serve("reload", [this](std_srvs::TriggerResponse* response) { reload(response); });
    runSource(assembler_.get());
  }

  std::shared_ptr<const CameraRig> readRigWithExtrinsics() const {
    std::shared_ptr<const CameraRig> rig = readRig();
    if (!rig->hasExtrinsics()) {
      throw InputError(requireParameter("rig", "") + ": expected vehicle_from_camera of every camera");
    }
    return rig;
  }

  std::unique_ptr<DriveLocalizer> openMap(const std::shared_ptr<const CameraRig>& rig) const {
    const std::string path = requireParameter("map", "the path of a map (*.vmap)");
    return std::make_unique<DriveLocalizer>(std::make_shared<const TiledMap>(path), rig, options_);
  }

  void seed(const InitialPose& message) {
    const PosePrior prior = fromMessage(message, "/initialpose", map_frame_);
    const std::lock_guard<std::mutex> lock(mutex_);
    localizer_->seed(prior);
  }

  void heed(const vcharge_msgs::RigHealth& health) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto condition = fromMessage(health, *rig_)) {
      localizer_->setCondition(*condition);
    }
  }

  void reload(std_srvs::TriggerResponse* response) {
    const std::shared_ptr<const CameraRig> rig = readRigWithExtrinsics();
    std::unique_ptr<DriveLocalizer> localizer = openMap(rig);
    const std::lock_guard<std::mutex> lock(mutex_);
    localizer->continueFrom(*localizer_);
    localizer_ = std::move(localizer);
    rig_ = rig;
    response->success = 1;
    response->message = "goes on with the newest versions of the map and of the rig";
  }

  void localize(const ImageFrame& frame) {
    const std::lock_guard<std::mutex> lock(mutex_);
    report_.add(topics_->publish(localizer_->process(frame), *rig_));
  }

  std::shared_ptr<const CameraRig> rig_;
  DriveLocalizerOptions options_;
  std::string map_frame_ = "map";
  std::mutex mutex_;  // guards the localizer
  std::unique_ptr<DriveLocalizer> localizer_;
  std::unique_ptr<ImageFrameAssembler> assembler_;
  std::unique_ptr<LocalizationTopics> topics_;
  LocalizationReport report_;
  std::unique_ptr<LiveQueue<ImageFrame>> queue_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::LocalizationNodelet, nodelet::Nodelet)
