#include <memory>
#include <optional>
#include <vector>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <pluginlib/class_list_macros.hpp>

#include "shared_topic.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// What a recorded drive needs beside its topics: odom -> base_link from the odometry, the rig's cameras on
/// /tf_static, and camera_info with each image's stamp. Stands aside on /tf and on each camera_info where
/// another node, or the bag, publishes the same. Parameters: ~rig (path), ~topics (DriveTopics).
class DriveTfNodelet : public Nodelet {
 private:
  using OdometryPtr = nav_msgs::OdometryConstPtr;
  static constexpr double kMaxSilence_s = 2.0;

  void initialize() override {
    node_ = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    rig_ = readCameraRig(requireStringParameter(private_node, "rig", "the path of a rig.yaml"));
    readFieldsFromParameters(private_node, "topics", &topics_);
    monitor_ = std::make_unique<DriveMonitor>(kMaxSilence_s, Clock::now());
    monitor_->expectTopic(topics_.odometry);

    broadcastCameras();
    for (size_t i = 0; i < rig_.cameras.size(); ++i) {
      advertiseCameraInfo(i);
    }
    tf_ = std::make_unique<internal::SharedTopic<tf2_msgs::TFMessage>>(
        &node_, "/tf", 100, kPatience,
        [this](const tf2_msgs::TFMessage& message) { return isOurs(message); });
    subscribers_.push_back(node_.subscribe<nav_msgs::Odometry>(
        topics_.odometry, 100, boost::function<void(const OdometryPtr&)>([this](const OdometryPtr& message) {
          onOdometry(message);
        })));
    diagnostics_ = std::make_unique<NodeletDiagnostics>(node_, private_node, getName(),
                                                        [this] { return monitor_->report(Clock::now()); });
  }

  bool isOurs(const tf2_msgs::TFMessage& message) const {
    for (const geometry_msgs::TransformStamped& transform : message.transforms) {
      if (transform.header.frame_id == odom_frame_ && transform.child_frame_id == rig_.vehicle_frame) {
        return true;
      }
    }
    return false;
  }

  void broadcastCameras() {
    std::vector<geometry_msgs::TransformStamped> transforms;
    for (const RigCamera& camera : rig_.cameras) {
      if (camera.vehicle_from_camera) {
        transforms.push_back(toTransformStamped(*camera.vehicle_from_camera, toTimestamp(ros::Time::now()),
                                                rig_.vehicle_frame, camera.frame_id));
      } else {
        NODELET_WARN_STREAM("rig: cameras." << camera.name
                                            << " has no vehicle_from_camera: not on /tf_static");
      }
    }
    static_broadcaster_.sendTransform(transforms);
  }

  void advertiseCameraInfo(size_t index) {
    const RigCamera& camera = rig_.cameras[index];
    CameraInfoResidual residual;
    camera_infos_.push_back(makeCameraInfo(camera, &residual));
    last_info_stamps_.emplace_back();
    NODELET_INFO_STREAM("camera_info of '" << camera.name << "': " << camera_infos_.back().distortion_model
                                           << " differs from the rig's model by " << residual.rms_px
                                           << " px rms, at most " << residual.max_px << " px");
    info_topics_.push_back(std::make_unique<internal::SharedTopic<sensor_msgs::CameraInfo>>(
        &node_, topics_.cameraInfoTopic(camera.name), 20, kPatience,
        [](const sensor_msgs::CameraInfo&) { return true; }));
    subscribeImages<sensor_msgs::Image>(topics_.imageTopic(camera.name), index);
    subscribeImages<sensor_msgs::CompressedImage>(topics_.compressedImageTopic(camera.name), index);
  }

  template <class Message>
  void subscribeImages(const std::string& topic, size_t index) {
    using Pointer = boost::shared_ptr<const Message>;
    subscribers_.push_back(node_.subscribe<Message>(
        topic, 4, boost::function<void(const Pointer&)>([this, index](const Pointer& message) {
          if (last_info_stamps_[index] == message->header.stamp) {
            return;  // told for the image's raw or compressed twin
          }
          last_info_stamps_[index] = message->header.stamp;
          auto info = boost::make_shared<sensor_msgs::CameraInfo>(camera_infos_[index]);
          info->header.stamp = message->header.stamp;
          info_topics_[index]->publish(info);
        })));
  }

  void onOdometry(const OdometryPtr& message) {
    const bool good = guard_.run([&] {
      const VehicleOdometry odometry = fromMessage(*message, topics_.odometry, rig_.vehicle_frame);
      monitor_->addGood(topics_.odometry, odometry.stamp, Clock::now());
      if (!message->header.frame_id.empty()) {
        odom_frame_ = message->header.frame_id;
      }
      if (last_stamp_ && *last_stamp_ == odometry.stamp) {
        return;  // TF complains about repeated stamps
      }
      last_stamp_ = odometry.stamp;
      auto transforms = boost::make_shared<tf2_msgs::TFMessage>();
      transforms->transforms.push_back(
          toTransformStamped(odometry.odom_from_vehicle, odometry.stamp, odom_frame_, rig_.vehicle_frame));
      tf_->publish(transforms);
    });
    if (!good) {
      monitor_->addBad(topics_.odometry, guard_.lastError(), Clock::now());
    }
  }

  using Clock = std::chrono::steady_clock;
  static constexpr Clock::duration kPatience = std::chrono::seconds(2);

  ros::NodeHandle node_;
  CameraRig rig_;
  DriveTopics topics_;
  CallbackGuard guard_{"drive_tf"};
  std::unique_ptr<DriveMonitor> monitor_;
  std::string odom_frame_ = "odom";
  std::optional<Timestamp> last_stamp_;
  std::vector<sensor_msgs::CameraInfo> camera_infos_;       // by camera
  std::vector<std::optional<ros::Time>> last_info_stamps_;  // by camera
  std::vector<std::unique_ptr<internal::SharedTopic<sensor_msgs::CameraInfo>>> info_topics_;
  std::unique_ptr<internal::SharedTopic<tf2_msgs::TFMessage>> tf_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
  std::unique_ptr<NodeletDiagnostics> diagnostics_;
  std::vector<ros::Subscriber> subscribers_;  // last: no callback while the rest is destroyed
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::DriveTfNodelet, nodelet::Nodelet)
