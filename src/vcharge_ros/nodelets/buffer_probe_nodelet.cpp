#include <array>
#include <cstdint>
#include <string>

#include <diagnostic_msgs/KeyValue.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <pluginlib/class_list_macros.hpp>

#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Tells where the images of a topic lie in memory, to see whether nodelets of one manager share them or are
/// given copies: subscribes to `image`, publishes on ~buffers a KeyValue of the stamp (nanoseconds) and the
/// address of the first pixel. It keeps the last images, so that no address comes again by chance.
class BufferProbeNodelet : public Nodelet {
 private:
  static constexpr uint32_t kQueueSize = 50;
  static constexpr size_t kKept = 20;

  void initialize() override {
    buffers_ = getPrivateNodeHandle().advertise<diagnostic_msgs::KeyValue>("buffers", kQueueSize);
    images_ = getNodeHandle().subscribe<sensor_msgs::Image>(
        "image", kQueueSize,
        boost::function<void(const sensor_msgs::ImageConstPtr&)>(
            [this](const sensor_msgs::ImageConstPtr& image) { tell(image); }));
  }

  void tell(const sensor_msgs::ImageConstPtr& image) {
    kept_[next_++ % kKept] = image;
    diagnostic_msgs::KeyValue message;
    message.key = std::to_string(image->header.stamp.toNSec());
    message.value = std::to_string(reinterpret_cast<uintptr_t>(image->data.data()));
    buffers_.publish(message);
  }

  std::array<sensor_msgs::ImageConstPtr, kKept> kept_;
  size_t next_ = 0;
  ros::Publisher buffers_;
  ros::Subscriber images_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::BufferProbeNodelet, nodelet::Nodelet)
