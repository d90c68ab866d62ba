#pragma once

#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/image.h"
#include "vcharge_ros/drive_topics.h"

namespace vcharge {

/// Publishes /camera/<name>/image_raw and camera_info for some cameras of a rig. The images are published in
/// the messages that already hold their pixels, without a copy.
class ImagePublisher {
 public:
  ImagePublisher(ros::NodeHandle* node, const CameraRig& rig, const std::vector<std::string>& cameras,
                 const DriveTopics& topics);

  /// Publishes the images of a frame from MessageSink, which has them in the order of `cameras`; those of
  /// lost images are empty. All have the frame's stamp.
  void publish(const MultiFrame& frame) const;

 private:
  struct Camera {
    std::string frame_id;
    ros::Publisher image, info;
    sensor_msgs::CameraInfo camera_info;
  };
  std::vector<Camera> cameras_;
};

}  // namespace vcharge
