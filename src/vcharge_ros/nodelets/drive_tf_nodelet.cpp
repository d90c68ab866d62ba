#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <pluginlib/class_list_macros.hpp>

#include "camera_info_publisher.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Completes the topics of a recorded drive: odom -> base_link from the odometry, the rig's cameras on
/// /tf_static, and camera_info with each image's stamp. Does not publish on /tf or a camera_info topic where
/// another node, or the bag, publishes the same. Parameters: ~rig (path), ~topics (DriveTopics).
class DriveTfNodelet : public Nodelet {
 public:
  DriveTfNodelet() : Nodelet("drive_tf") {}
  ~DriveTfNodelet() override { end(); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr double kMaxSilence_s = 2.0;

  void start() override {
    rig_ = readRig();
    readOptions("topics", &topics_);
    monitor_ = std::make_unique<DriveMonitor>(kMaxSilence_s, Clock::now());
    monitor_->expectTopic(topics_.odometry);
    const std::vector<geometry_msgs::TransformStamped> cameras =
        cameraTransforms(*rig_, toTimestamp(ros::Time::now()));
    if (cameras.size() < rig_->cameras.size()) {
      NODELET_WARN("rig: cameras without vehicle_from_camera are not on /tf_static");
    }
    static_broadcaster_.sendTransform(cameras);
    for (const RigCamera& camera : rig_->cameras) {
      addCamera(camera);
    }
    tf_ = std::make_unique<internal::SharedTopic<tf2_msgs::TFMessage>>(
        &node(), "/tf", 100, [this](const tf2_msgs::TFMessage& message) { return isOurs(message); });
    addDiagnostics(
        "", [this] { return monitor_->report(Clock::now()); }, Threads::kOne);
    subscribe<nav_msgs::Odometry>(
        topics_.odometry, 100, [this](const nav_msgs::OdometryConstPtr& message) { addOdometry(*message); });
  }

  bool isOurs(const tf2_msgs::TFMessage& message) const {
    for (const geometry_msgs::TransformStamped& transform : message.transforms) {
      if (transform.header.frame_id == odom_frame_ && transform.child_frame_id == rig_->vehicle_frame) {
        return true;
      }
    }
    return false;
  }

  void addCamera(const RigCamera& camera) {
    infos_.push_back(
        std::make_unique<CameraInfoPublisher>(&node(), camera, topics_.cameraInfoTopic(camera.name)));
    CameraInfoPublisher* const info = infos_.back().get();
    NODELET_INFO_STREAM("camera_info of '" << camera.name << "': " << info->model()
                                           << " differs from the rig's model by " << info->residual().rms_px
                                           << " px rms, at most " << info->residual().max_px << " px");
    subscribe<sensor_msgs::Image>(
        topics_.imageTopic(camera.name), 4,
        [info](const sensor_msgs::ImageConstPtr& message) { info->publish(message->header.stamp); });
    subscribe<sensor_msgs::CompressedImage>(topics_.compressedImageTopic(camera.name), 4,
                                            [info](const sensor_msgs::CompressedImageConstPtr& message) {
                                              info->publish(message->header.stamp);
                                            });
  }

  void addOdometry(const nav_msgs::Odometry& message) {
    try {
      broadcast(message);
    } catch (const std::exception& error) {
      monitor_->addBad(topics_.odometry, error.what(), Clock::now());
      throw;
    }
  }

  void broadcast(const nav_msgs::Odometry& message) {
    const VehicleOdometry odometry = fromMessage(message, topics_.odometry, rig_->vehicle_frame);
    monitor_->addGood(topics_.odometry, odometry.stamp, Clock::now());
    if (!message.header.frame_id.empty()) {
      odom_frame_ = message.header.frame_id;
    }
    if (last_stamp_ == odometry.stamp) {
      return;  // TF warns about repeated stamps
    }
    last_stamp_ = odometry.stamp;
    auto transforms = boost::make_shared<tf2_msgs::TFMessage>();
    transforms->transforms.push_back(
        toTransformStamped(odometry.odom_from_vehicle, odometry.stamp, odom_frame_, rig_->vehicle_frame));
    tf_->publish(transforms);
  }

  std::shared_ptr<const CameraRig> rig_;
  DriveTopics topics_;
  std::unique_ptr<DriveMonitor> monitor_;
  std::string odom_frame_ = "odom";
  std::optional<Timestamp> last_stamp_;
  std::vector<std::unique_ptr<CameraInfoPublisher>> infos_;  // one per camera
  std::unique_ptr<internal::SharedTopic<tf2_msgs::TFMessage>> tf_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::DriveTfNodelet, nodelet::Nodelet)
