#pragma once

#include <string>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/frames/image.h"

namespace vcharge {

/// View of a mono8 (or 8UC1) message without copying pixels; the image keeps the message alive. bgr8,
/// rgb8, bgra8, rgba8 and mono16 (its upper 8 bits) are converted. InputError "<source>: ..." for other
/// encodings and for a message whose data do not fit its size.
Image toImage(const sensor_msgs::ImageConstPtr& message, const std::string& source);
/// Decodes a compressed message (JPEG, PNG) to gray. InputError "<source>: ..." if it cannot be decoded.
Image toImage(const sensor_msgs::CompressedImageConstPtr& message, const std::string& source);

/// Copies the pixels of CV_8UC1 (mono8) or CV_32FC1 (32FC1); std::logic_error for other types.
sensor_msgs::ImagePtr toImageMessage(const cv::Mat& pixels, Timestamp stamp, const std::string& frame_id);

}  // namespace vcharge
