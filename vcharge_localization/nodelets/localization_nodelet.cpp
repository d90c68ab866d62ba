#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <tf2_ros/transform_broadcaster.h>
#include <pluginlib/class_list_macros.hpp>

#include "localization_messages.h"
#include "localization_report.h"
#include "vcharge_core/base/error.h"
#include "vcharge_localization/drive_localizer.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/live_queue.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Localizes a live or replayed drive in a map. Publishes /localization/pose (while the pose is
/// known), /localization/status (every frame), /localization/observations (markers), map -> odom on /tf, and
/// a status in /diagnostics; /initialpose sets a prior pose. Parameters: ~rig, ~map (paths), ~options
/// (DriveLocalizerOptions), ~source (LiveDriveSourceOptions), ~map_frame, ~odom_frame, ~lossless_replay
/// (every frame in order, as localize_drive; otherwise the newest first, and drops are counted).
class LocalizationNodelet : public Nodelet {
 public:
  LocalizationNodelet() : Nodelet("localization") {}
  ~LocalizationNodelet() override { end(); }

 private:
  using InitialPose = geometry_msgs::PoseWithCovarianceStamped;

  void start() override {
    rig_ = readRig();
    if (!rig_->hasExtrinsics()) {
      throw InputError(requireParameter("rig", "") + ": expected vehicle_from_camera of every camera");
    }
    const std::string map_path = requireParameter("map", "the path of a map (*.vmap)");
    map_frame_ = parameter("map_frame", map_frame_);
    odom_frame_ = parameter("odom_frame", odom_frame_);
    DriveLocalizerOptions options;
    if (isLossless()) {
      options.frames.waitForEverything();
    }
    readOptions("options", &options);
    openSource(rig_);
    localizer_ = std::make_unique<DriveLocalizer>(std::make_shared<const TiledMap>(map_path), rig_, options);

    pose_ = node().advertise<geometry_msgs::PoseWithCovarianceStamped>("/localization/pose", 10);
    status_ = node().advertise<vcharge_msgs::LocalizationStatus>("/localization/status", 10);
    observations_ = node().advertise<visualization_msgs::Marker>("/localization/observations", 2);
    broadcaster_ = std::make_unique<tf2_ros::TransformBroadcaster>();
    queue_ = std::make_unique<LiveQueue<ImageFrame>>(
        isLossless(), [this](const ImageFrame& frame) { guard().run([&] { localize(frame); }); });
    assembler_ = std::make_unique<ImageFrameAssembler>(
        rig_->cameras.size(), options.frames,
        [this](ImageFrame frame) { queue_->push(0, std::move(frame)); });
    addDiagnostics(
        "/pose", [this] { return report_.report(queue_->numDropped(0), assembler_->counters()); },
        Threads::kOne);
    subscribe<InitialPose>("/initialpose", 1,
                           [this](const InitialPose::ConstPtr& message) { seed(*message); });
    runSource(assembler_.get());
  }

  void seed(const InitialPose& message) {
    const PosePrior prior = fromMessage(message, "/initialpose", map_frame_);
    const std::lock_guard<std::mutex> lock(mutex_);
    localizer_->seed(prior);
  }

  void localize(const ImageFrame& frame) {
    const std::lock_guard<std::mutex> lock(mutex_);
    publish(localizer_->process(frame));
  }

  void publish(const LocalizationResult& result) {
    const vcharge_msgs::LocalizationStatus status = toStatusMessage(result, *rig_, map_frame_);
    status_.publish(status);
    report_.add(status);
    if (observations_.getNumSubscribers() > 0) {
      observations_.publish(toObservationMarker(result, *rig_, map_frame_));
    }
    if (!result.pose) {
      return;
    }
    pose_.publish(toPoseMessage(result, map_frame_));
    if (result.odom_from_vehicle) {
      broadcaster_->sendTransform(
          toTransformStamped(result.pose->map_from_vehicle * result.odom_from_vehicle->inverse(),
                             result.stamp, map_frame_, odom_frame_));
    }
  }

  std::shared_ptr<const CameraRig> rig_;
  std::string map_frame_ = "map", odom_frame_ = "odom";
  std::mutex mutex_;  // guards the localizer
  std::unique_ptr<DriveLocalizer> localizer_;
  std::unique_ptr<ImageFrameAssembler> assembler_;
  std::unique_ptr<tf2_ros::TransformBroadcaster> broadcaster_;
  ros::Publisher pose_, status_, observations_;
  LocalizationReport report_;
  std::unique_ptr<LiveQueue<ImageFrame>> queue_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::LocalizationNodelet, nodelet::Nodelet)
