#include "message_sink.h"

#include <sensor_msgs/image_encodings.h>

#include "vcharge_camera_driver/clock_map.h"

namespace vcharge {

MessageSink::MessageSink(size_t num_cameras, const TriggerGrouperOptions& options, bool has_trigger,
                         double stamp_offset_s, GroupCallback callback)
    : num_cameras_(num_cameras),
      has_trigger_(has_trigger),
      stamp_offset_(durationFromSeconds(stamp_offset_s)),
      callback_(std::move(callback)),
      grouper_(num_cameras, options) {}

Image MessageSink::acquire(cv::Size size_px) {
  const std::shared_ptr<sensor_msgs::Image> message = pool_.acquire();
  message->encoding = sensor_msgs::image_encodings::MONO8;
  message->width = static_cast<uint32_t>(size_px.width);
  message->height = static_cast<uint32_t>(size_px.height);
  message->step = message->width;
  message->data.resize(static_cast<size_t>(message->step) * message->height);
  Image image;
  image.pixels = cv::Mat(size_px, CV_8UC1, message->data.data());
  image.owner = message;
  return image;
}

sensor_msgs::ImagePtr MessageSink::messageOf(const Image& image) {
  // The cast is safe: acquire() created the message, and nobody shares it before it is published.
  auto pooled = std::const_pointer_cast<sensor_msgs::Image>(
      std::static_pointer_cast<const sensor_msgs::Image>(image.owner));
  sensor_msgs::Image* raw = pooled.get();
  return sensor_msgs::ImagePtr(raw, [pooled](sensor_msgs::Image*) mutable { pooled.reset(); });
}

void MessageSink::add(const CapturedFrame& frame) {
  CapturedFrame shifted = frame;
  shifted.stamp = frame.stamp + stamp_offset_;
  if (!has_trigger_) {
    MultiFrame single{shifted.stamp, std::vector<Image>(num_cameras_)};
    single.images[frame.camera_index] = frame.image;
    callback_(single);
    return;
  }
  TriggerGrouper::Groups groups;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    groups = grouper_.add(shifted, monotonicNow());
  }
  pass(groups);
}

Duration MessageSink::idle() {
  TriggerGrouper::Groups groups;
  std::optional<Timestamp> deadline;
  const Timestamp now = monotonicNow();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    groups = grouper_.expire(now);
    deadline = grouper_.nextDeadline();
  }
  pass(groups);
  return deadline ? std::max(Duration(0), *deadline - now) : Duration(std::chrono::seconds(1));
}

TriggerGrouperCounts MessageSink::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return grouper_.counts();
}

std::optional<TriggerCameraCounts> MessageSink::countsOf(size_t camera) const {
  return has_trigger_ ? std::optional(counts().cameras.at(camera)) : std::nullopt;
}

void MessageSink::pass(const TriggerGrouper::Groups& groups) {
  for (const auto& group : groups) {
    callback_(*group);
  }
}

}  // namespace vcharge
