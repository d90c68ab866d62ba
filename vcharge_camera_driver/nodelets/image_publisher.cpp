#include "image_publisher.h"

#include "message_sink.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr uint32_t kQueueSize = 10;

}  // namespace

ImagePublisher::ImagePublisher(ros::NodeHandle* node, const CameraRig& rig,
                               const std::vector<std::string>& cameras, const DriveTopics& topics) {
  for (const std::string& name : cameras) {
    const RigCamera& camera = rig.cameras[rig.cameraIndex(name)];
    cameras_.push_back({camera.frame_id,
                        node->advertise<sensor_msgs::Image>(topics.imageTopic(name), kQueueSize),
                        node->advertise<sensor_msgs::CameraInfo>(topics.cameraInfoTopic(name), kQueueSize),
                        makeCameraInfo(camera)});
  }
}

void ImagePublisher::publish(const MultiFrame& frame) const {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (frame.images[i].pixels.empty()) {
      continue;  // this camera's image was lost
    }
    const Camera& camera = cameras_[i];
    const sensor_msgs::ImagePtr message = MessageSink::messageOf(frame.images[i]);
    message->header.stamp = fromTimestamp(frame.stamp);
    message->header.frame_id = camera.frame_id;
    const auto info = boost::make_shared<sensor_msgs::CameraInfo>(camera.camera_info);
    info->header = message->header;
    camera.image.publish(message);
    camera.info.publish(info);
  }
}

}  // namespace vcharge
