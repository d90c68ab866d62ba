#include "mapper_listener.h"

#include <algorithm>
#include <utility>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <vcharge_msgs/ScheduledCameras.h>
#include <vcharge_msgs/TrackedObjects.h>

#include "vcharge_core/base/error.h"
#include "vcharge_obstacles/image_fingerprint.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/obstacle_conversions.h"

namespace vcharge {

MapperListener::MapperListener(ros::NodeHandle* node, const CameraRig& rig,
                               const std::vector<ObstacleCameraStatus>& cameras, uint32_t queue_size,
                               CallbackGuard* guard, ImageCallback on_image, ObjectCallback on_objects,
                               ScheduleCallback on_schedule)
    : guard_(guard),
      on_image_(std::move(on_image)),
      on_objects_(std::move(on_objects)),
      on_schedule_(std::move(on_schedule)) {
  const DriveTopics topics;
  for (const ObstacleCameraStatus& camera : cameras) {
    const size_t index = rig.cameraIndex(camera.camera_name);
    subscribe<sensor_msgs::Image>(node, index, topics.imageTopic(camera.camera_name), queue_size);
    subscribe<sensor_msgs::CompressedImage>(node, index, topics.compressedImageTopic(camera.camera_name),
                                            queue_size);
  }
  subscribeObjects(node, queue_size);
  subscribeSchedule(node, rig, queue_size);
}

void MapperListener::subscribeSchedule(ros::NodeHandle* node, const CameraRig& rig, uint32_t queue_size) {
  using Pointer = vcharge_msgs::ScheduledCamerasConstPtr;
  constexpr char kTopic[] = "/dense/scheduled";
  std::vector<std::string> names;
  for (const RigCamera& camera : rig.cameras) {
    names.push_back(camera.name);
  }
  const auto note = [this, names, kTopic](const Pointer& message) {
    guard_->run([&] {
      if (message->header.stamp.isZero()) {
        throw InputError(std::string(kTopic) + ": expected a stamp in the header, got 0");
      }
      std::vector<bool> cameras;
      for (const std::string& name : names) {
        cameras.push_back(std::count(message->cameras.begin(), message->cameras.end(), name) > 0);
      }
      on_schedule_(toTimestamp(message->header.stamp), cameras);
    });
  };
  subscribers_.push_back(subscribePromptly<vcharge_msgs::ScheduledCameras>(node, kTopic, queue_size, note));
}

void MapperListener::subscribeObjects(ros::NodeHandle* node, uint32_t queue_size) {
  using Pointer = vcharge_msgs::TrackedObjectsConstPtr;
  constexpr char kTopic[] = "/obstacles/objects";
  const auto note = [this, kTopic](const Pointer& message) {
    guard_->run([&] {
      if (message->header.stamp.isZero() || message->header.frame_id != "odom") {
        throw InputError(std::string(kTopic) +
                         ": expected a stamp and the frame odom in the header, got frame '" +
                         message->header.frame_id + "'");
      }
      on_objects_(toTimestamp(message->header.stamp), fromMessage(*message, kTopic));
    });
  };
  subscribers_.push_back(subscribePromptly<vcharge_msgs::TrackedObjects>(node, kTopic, queue_size, note));
}

template <class Message>
void MapperListener::subscribe(ros::NodeHandle* node, size_t camera_index, const std::string& topic,
                               uint32_t queue_size) {
  using Pointer = boost::shared_ptr<const Message>;
  const auto note = [this, camera_index, topic](const Pointer& message) {
    guard_->run([&] {
      if (message->header.stamp.isZero()) {
        throw InputError(topic + ": expected a stamp in the message's header, got 0");
      }
      on_image_(camera_index, toTimestamp(message->header.stamp),
                fingerprintOf(message->data.data(), message->data.size()),
                [message, topic] { return toImage(message, topic).pixels; });
    });
  };
  subscribers_.push_back(subscribePromptly<Message>(node, topic, queue_size, note));
}

}  // namespace vcharge
