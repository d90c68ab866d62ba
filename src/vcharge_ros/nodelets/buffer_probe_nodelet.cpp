#include <array>
#include <cstdint>
#include <string>

#include <diagnostic_msgs/KeyValue.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <pluginlib/class_list_macros.hpp>

#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Test tool: shows whether nodelets of one manager share images or get copies. Subscribes to `image` and
/// publishes on ~buffers a KeyValue of the stamp (nanoseconds) and the address of the first pixel. Keeps the
/// last images so that no address is used twice.
class BufferProbeNodelet : public Nodelet {
 public:
  BufferProbeNodelet() : Nodelet("buffer_probe") {}
  ~BufferProbeNodelet() override { end(); }

 private:
  static constexpr uint32_t kQueueSize = 50;
  static constexpr size_t kKept = 20;

  void start() override {
    buffers_ = privateNode().advertise<diagnostic_msgs::KeyValue>("buffers", kQueueSize);
    subscribe<sensor_msgs::Image>("image", kQueueSize,
                                  [this](const sensor_msgs::ImageConstPtr& image) { publish(image); });
  }

  void publish(const sensor_msgs::ImageConstPtr& image) {
    kept_[next_++ % kKept] = image;
    diagnostic_msgs::KeyValue message;
    message.key = std::to_string(image->header.stamp.toNSec());
    message.value = std::to_string(reinterpret_cast<uintptr_t>(image->data.data()));
    buffers_.publish(message);
  }

  std::array<sensor_msgs::ImageConstPtr, kKept> kept_;
  size_t next_ = 0;
  ros::Publisher buffers_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::BufferProbeNodelet, nodelet::Nodelet)
