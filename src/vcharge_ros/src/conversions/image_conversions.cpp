#include "vcharge_ros/image_conversions.h"

#include <limits>

#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

namespace encodings = sensor_msgs::image_encodings;

// OpenCV's type of an encoding's pixels and the conversion to gray (-1: none needed); false for unknown ones.
struct EncodingRule {
  const std::string& name;
  int cv_type;
  int to_gray;
};

const EncodingRule* findRule(const std::string& encoding) {
  static const EncodingRule kRules[] = {
      {encodings::MONO8, CV_8UC1, -1},
      {encodings::TYPE_8UC1, CV_8UC1, -1},
      {encodings::MONO16, CV_16UC1, -1},
      {encodings::BGR8, CV_8UC3, cv::COLOR_BGR2GRAY},
      {encodings::RGB8, CV_8UC3, cv::COLOR_RGB2GRAY},
      {encodings::BGRA8, CV_8UC4, cv::COLOR_BGRA2GRAY},
      {encodings::RGBA8, CV_8UC4, cv::COLOR_RGBA2GRAY},
  };
  for (const EncodingRule& rule : kRules) {
    if (rule.name == encoding) {
      return &rule;
    }
  }
  return nullptr;
}

// The upper 8 bits of 16-bit pixels in either byte order.
cv::Mat upperBytes(const cv::Mat& pixels16, bool big_endian) {
  cv::Mat pixels8(pixels16.size(), CV_8UC1);
  for (int y = 0; y < pixels16.rows; ++y) {
    const uint8_t* bytes = pixels16.ptr<uint8_t>(y) + (big_endian ? 0 : 1);
    uint8_t* out = pixels8.ptr<uint8_t>(y);
    for (int x = 0; x < pixels16.cols; ++x) {
      out[x] = bytes[2 * x];
    }
  }
  return pixels8;
}

}  // namespace

Image toImage(const sensor_msgs::ImageConstPtr& message, const std::string& source) {
  const EncodingRule* rule = findRule(message->encoding);
  if (rule == nullptr) {
    throw InputError(source + ": expected encoding mono8 (or bgr8, rgb8, bgra8, rgba8, mono16), got '" +
                     message->encoding + "'");
  }
  const uint64_t row_bytes = static_cast<uint64_t>(message->width) * CV_ELEM_SIZE(rule->cv_type);
  const uint64_t max_size = std::numeric_limits<int>::max();
  if (message->width == 0 || message->height == 0 || row_bytes > max_size || message->height > max_size ||
      message->step < row_bytes ||
      message->data.size() < static_cast<uint64_t>(message->step) * (message->height - 1) + row_bytes) {
    throw InputError(source + ": " + std::to_string(message->data.size()) + " bytes of data and step " +
                     std::to_string(message->step) + " do not hold " + std::to_string(message->width) + "x" +
                     std::to_string(message->height) + " pixels of " + message->encoding);
  }
  // The pixels of an Image are never written to.
  const cv::Mat view(static_cast<int>(message->height), static_cast<int>(message->width), rule->cv_type,
                     const_cast<uint8_t*>(message->data.data()), message->step);
  Image image;
  if (rule->cv_type == CV_8UC1) {
    image.pixels = view;
    image.owner = std::shared_ptr<const void>(message.get(), [message](const void*) {});
  } else if (rule->cv_type == CV_16UC1) {
    image.pixels = upperBytes(view, message->is_bigendian != 0);
  } else {
    cv::cvtColor(view, image.pixels, rule->to_gray);
  }
  return image;
}

Image toImage(const sensor_msgs::CompressedImageConstPtr& message, const std::string& source) {
  Image image;
  std::string reason;
  if (!message->data.empty()) {
    try {
      image.pixels = cv::imdecode(message->data, cv::IMREAD_GRAYSCALE);
    } catch (const cv::Exception& error) {
      reason = " (" + error.err + ")";
    }
  }
  if (image.pixels.empty()) {
    throw InputError(source + ": expected a JPEG or PNG image, got " + std::to_string(message->data.size()) +
                     " bytes of format '" + message->format + "' that cannot be decoded" + reason);
  }
  return image;
}

sensor_msgs::ImagePtr toImageMessage(const cv::Mat& pixels, Timestamp stamp, const std::string& frame_id) {
  check(pixels.type() == CV_8UC1 || pixels.type() == CV_32FC1,
        "toImageMessage: expected CV_8UC1 or CV_32FC1");
  auto message = boost::make_shared<sensor_msgs::Image>();
  message->header.stamp = fromTimestamp(stamp);
  message->header.frame_id = frame_id;
  message->encoding = pixels.type() == CV_8UC1 ? encodings::MONO8 : encodings::TYPE_32FC1;
  message->width = static_cast<uint32_t>(pixels.cols);
  message->height = static_cast<uint32_t>(pixels.rows);
  message->step = static_cast<uint32_t>(pixels.cols * pixels.elemSize());
  message->data.resize(static_cast<size_t>(message->step) * message->height);
  pixels.copyTo(cv::Mat(pixels.size(), pixels.type(), message->data.data(), message->step));
  return message;
}

}  // namespace vcharge
