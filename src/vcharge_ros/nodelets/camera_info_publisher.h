#pragma once

#include <optional>
#include <string>

#include <sensor_msgs/CameraInfo.h>

#include "shared_topic.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_ros/camera_info.h"

namespace vcharge {

/// Publishes camera_info of one camera of a rig, with the stamp of each of its images.
class CameraInfoPublisher {
 public:
  CameraInfoPublisher(ros::NodeHandle* node, const RigCamera& camera, const std::string& topic)
      : info_(makeCameraInfo(camera, &residual_)),
        topic_(node, topic, kQueueSize, [](const sensor_msgs::CameraInfo&) { return true; }) {}

  /// Distance between the published model and the rig's.
  const CameraInfoResidual& residual() const { return residual_; }
  const std::string& model() const { return info_.distortion_model; }

  /// Publishes once per stamp, since an image may arrive both raw and compressed.
  void publish(const ros::Time& stamp) {
    if (last_stamp_ != stamp) {
      last_stamp_ = stamp;
      auto info = boost::make_shared<sensor_msgs::CameraInfo>(info_);
      info->header.stamp = stamp;
      topic_.publish(info);
    }
  }

 private:
  static constexpr uint32_t kQueueSize = 20;
  CameraInfoResidual residual_;
  const sensor_msgs::CameraInfo info_;
  internal::SharedTopic<sensor_msgs::CameraInfo> topic_;
  std::optional<ros::Time> last_stamp_;
};

}  // namespace vcharge
