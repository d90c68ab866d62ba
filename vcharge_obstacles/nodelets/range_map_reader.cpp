#include "range_map_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr size_t kMaxIncomplete = 20;

/// Returns an image header for the message's pixels, which must not be written.
cv::Mat toImage(const sensor_msgs::ImageConstPtr& message, const std::string& encoding, int type,
                const std::string& topic) {
  const size_t row_bytes = message->width * CV_ELEM_SIZE(type);
  if (message->encoding != encoding || (CV_ELEM_SIZE1(type) > 1 && message->is_bigendian != 0) ||
      message->step != row_bytes || message->data.size() != row_bytes * message->height ||
      message->data.empty()) {
    throw InputError(topic + ": expected " + encoding + " images without padding, got " + message->encoding +
                     " of " + std::to_string(message->width) + "x" + std::to_string(message->height));
  }
  return cv::Mat(static_cast<int>(message->height), static_cast<int>(message->width), type,
                 const_cast<uint8_t*>(message->data.data()));
}

/// Describes size, model, frame and intrinsics in error texts.
std::string describe(const sensor_msgs::CameraInfo& info) {
  return std::to_string(info.width) + "x" + std::to_string(info.height) + " " + info.distortion_model +
         " in " + info.header.frame_id + ", K " + toText(info.K[0], 2) + ", " + toText(info.K[4], 2) + ", " +
         toText(info.K[2], 2) + ", " + toText(info.K[5], 2);
}

bool isSameCamera(const sensor_msgs::CameraInfo& a, const sensor_msgs::CameraInfo& b) {
  constexpr double kTolerance = 1e-3;  // pixels and coefficients: model fits differ by platform
  const auto is_near = [](double x, double y) { return std::abs(x - y) <= kTolerance; };
  return a.width == b.width && a.height == b.height && a.distortion_model == b.distortion_model &&
         a.header.frame_id == b.header.frame_id && a.D.size() == b.D.size() &&
         std::equal(a.D.begin(), a.D.end(), b.D.begin(), is_near) &&
         std::equal(a.K.begin(), a.K.end(), b.K.begin(), is_near);
}

}  // namespace

RangeMapReader::RangeMapReader(const RigCamera& camera, std::string topic)
    : camera_(camera), topic_(std::move(topic)) {}

void RangeMapReader::prepare(cv::Size size) {
  if (size == size_) {
    return;
  }
  WorkingCameraOptions options;
  options.image_scale = static_cast<double>(size.width) / camera_.image_size_px.width;
  const WorkingCamera working(camera_.model, camera_.image_size_px, camera_.field_of_view_rad, camera_.mask,
                              options);
  if (working.size() != size) {
    throw InputError(topic_ + "/image: expected the aspect ratio of camera '" + camera_.name + "', as " +
                     std::to_string(working.size().width) + "x" + std::to_string(working.size().height) +
                     ", got " + std::to_string(size.width) + "x" + std::to_string(size.height));
  }
  model_ = working.model();
  expected_ = makeCameraInfo(*model_, size, camera_.field_of_view_rad, camera_.frame_id);
  size_ = size;
}

RangeMap RangeMapReader::read(const RangeMapParts& parts) {
  const cv::Mat range_m = toImage(parts.range, "32FC1", CV_32FC1, topic_ + "/image");
  const cv::Mat sigma_m =
      toImage(parts.standard_deviation, "32FC1", CV_32FC1, topic_ + "/standard_deviation");
  const cv::Mat confidence = toImage(parts.confidence, "32FC1", CV_32FC1, topic_ + "/confidence");
  const cv::Mat reference = toImage(parts.reference, "mono8", CV_8UC1, topic_ + "/reference");
  prepare(range_m.size());
  if (sigma_m.size() != size_ || confidence.size() != size_ || reference.size() != size_) {
    throw InputError(topic_ + ": expected four images of one size; not all have the range image's " +
                     std::to_string(size_.width) + "x" + std::to_string(size_.height));
  }
  if (!isSameCamera(*parts.camera_info, expected_)) {
    throw InputError(topic_ + "/camera_info: expected camera '" + camera_.name + "' of the rig, " +
                     describe(expected_) + "; got " + describe(*parts.camera_info));
  }
  return {toTimestamp(parts.range->header.stamp),
          camera_.name,
          camera_.frame_id,
          *model_,
          range_m,
          sigma_m,
          confidence,
          reference};
}

RangeMapSubscriber::RangeMapSubscriber(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size,
                                       CallbackGuard* guard, Callback callback)
    : guard_(guard),
      callback_(std::move(callback)),
      max_incomplete_(queue_size > 0 ? kMaxIncomplete : std::numeric_limits<size_t>::max()) {
  subscribe<sensor_msgs::Image>(node, topic + "/image", queue_size, &RangeMapParts::range);
  subscribe<sensor_msgs::Image>(node, topic + "/standard_deviation", queue_size,
                                &RangeMapParts::standard_deviation);
  subscribe<sensor_msgs::Image>(node, topic + "/confidence", queue_size, &RangeMapParts::confidence);
  subscribe<sensor_msgs::Image>(node, topic + "/reference", queue_size, &RangeMapParts::reference);
  subscribe<sensor_msgs::CameraInfo>(node, topic + "/camera_info", queue_size, &RangeMapParts::camera_info);
}

template <class Message>
void RangeMapSubscriber::subscribe(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size,
                                   boost::shared_ptr<const Message> RangeMapParts::*part) {
  using Pointer = boost::shared_ptr<const Message>;
  const auto add = [this, part](const Pointer& message) {
    RangeMapParts& parts = incomplete_[message->header.stamp];
    parts.*part = message;
    if (parts.complete()) {
      guard_->run([&] { callback_(parts); });
      // Each topic keeps its order: what earlier stamps lack does not come any more.
      incomplete_.erase(incomplete_.begin(), incomplete_.upper_bound(message->header.stamp));
    }
    while (incomplete_.size() > max_incomplete_) {
      incomplete_.erase(incomplete_.begin());
    }
  };
  subscribers_.push_back(subscribePromptly<Message>(node, topic, queue_size, add));
}

}  // namespace vcharge
