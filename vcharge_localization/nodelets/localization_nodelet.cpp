#include <memory>
#include <mutex>
#include <string>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <tf2_ros/transform_broadcaster.h>
#include <pluginlib/class_list_macros.hpp>

#include "localization_messages.h"
#include "localization_report.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_core/workers/newest_first_worker.h"
#include "vcharge_localization/drive_localizer.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// The vehicle's pose in a map, of a live or replayed drive. Publishes /localization/pose (while it is
/// known), /localization/status (every frame), /localization/sightings (markers), map -> odom on /tf, and a
/// status in /diagnostics; /initialpose seeds it. Parameters: ~rig, ~map (paths), ~options
/// (DriveLocalizerOptions), ~source (LiveDriveSourceOptions), ~topics, ~map_frame, ~odom_frame,
/// ~lossless_replay (every frame in order, as localize_drive; otherwise the newest first, drops are counted).
class LocalizationNodelet : public Nodelet {
 public:
  ~LocalizationNodelet() override {
    diagnostics_.clear();
    initial_pose_subscriber_.shutdown();
    source_.reset();  // no callback any more, hence no frame
    worker_.reset();
  }

 private:
  void initialize() override {
    try {
      start();
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM(error.what());  // the manager would only tell that it did not load
      throw;
    }
  }

  void start() {
    node_ = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    const std::string rig_path = requireStringParameter(private_node, "rig", "the path of a rig.yaml");
    rig_ = std::make_shared<const CameraRig>(readCameraRig(rig_path));
    if (!rig_->hasExtrinsics()) {
      throw InputError(rig_path + ": expected vehicle_from_camera of every camera");
    }
    const std::string map_path = requireStringParameter(private_node, "map", "the path of a map (*.vmap)");
    private_node.param("map_frame", map_frame_, map_frame_);
    private_node.param("odom_frame", odom_frame_, odom_frame_);
    const bool lossless = private_node.param("lossless_replay", false);
    DriveLocalizerOptions options;
    readFieldsFromParameters(private_node, "options", &options);
    LiveDriveSourceOptions source_options;
    if (lossless) {
      source_options.takeEverything();
    }
    readFieldsFromParameters(private_node, "source", &source_options);
    localizer_ = std::make_unique<DriveLocalizer>(readSparseMap(map_path), rig_, options);

    pose_ = node_.advertise<geometry_msgs::PoseWithCovarianceStamped>("/localization/pose", 10);
    status_ = node_.advertise<vcharge_msgs::LocalizationStatus>("/localization/status", 10);
    sightings_ = node_.advertise<visualization_msgs::Marker>("/localization/sightings", 2);
    broadcaster_ = std::make_unique<tf2_ros::TransformBroadcaster>();
    if (!lossless) {
      worker_ = std::make_unique<NewestFirstWorker<LocalizationFrame>>(
          [this](const LocalizationFrame& frame) { localize(frame); });
    }
    assembler_ = std::make_unique<FrameAssembler>(rig_->cameras.size(), options.frames,
                                                  [this](LocalizationFrame frame) {
                                                    if (worker_) {
                                                      worker_->push(0, std::move(frame));
                                                    } else {
                                                      localize(frame);
                                                    }
                                                  });
    source_ = std::make_unique<LiveDriveSource>(node_, rig_, source_options);
    diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(node_, private_node, getName(),
                                                                [this] { return source_->report(); }));
    diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(
        node_, private_node, getName() + "/pose",
        [this] { return report_.report(guard_, worker_ ? worker_->numDropped(0) : 0); }));
    source_->run(assembler_.get(), DriveSource::ProgressCallback());
    initial_pose_subscriber_ = node_.subscribe<geometry_msgs::PoseWithCovarianceStamped>(
        "/initialpose", 1,
        boost::function<void(const geometry_msgs::PoseWithCovarianceStampedConstPtr&)>(
            [this](const geometry_msgs::PoseWithCovarianceStampedConstPtr& message) {
              guard_.run([&] {
                const PosePrior prior = fromMessage(*message, "/initialpose", map_frame_);
                const std::lock_guard<std::mutex> lock(mutex_);
                localizer_->seed(prior);
              });
            }));
  }

  void localize(const LocalizationFrame& frame) {
    guard_.run([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      publish(localizer_->process(frame));
    });
  }

  void publish(const LocalizationResult& result) {
    const vcharge_msgs::LocalizationStatus status = toStatusMessage(result, *rig_, map_frame_);
    status_.publish(status);
    report_.add(status);
    if (sightings_.getNumSubscribers() > 0) {
      sightings_.publish(toSightingMarker(result, *rig_, localizer_->localizer().map(), map_frame_));
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

  ros::NodeHandle node_;
  std::shared_ptr<const CameraRig> rig_;
  std::string map_frame_ = "map", odom_frame_ = "odom";
  CallbackGuard guard_{"localization"};
  std::mutex mutex_;  // of the localizer
  std::unique_ptr<DriveLocalizer> localizer_;
  std::unique_ptr<FrameAssembler> assembler_;
  std::unique_ptr<NewestFirstWorker<LocalizationFrame>> worker_;
  std::unique_ptr<LiveDriveSource> source_;
  std::unique_ptr<tf2_ros::TransformBroadcaster> broadcaster_;
  ros::Publisher pose_, status_, sightings_;
  ros::Subscriber initial_pose_subscriber_;
  LocalizationReport report_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::LocalizationNodelet, nodelet::Nodelet)
