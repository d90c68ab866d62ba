#pragma once

#include <string>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Topics of a drive. Images are raw, or compressed on <image topic>/compressed if the drive has no raw ones.
struct DriveTopics {
  VCHARGE_BEGIN_OPTIONS(DriveTopics);
  VCHARGE_OPTION(std::string, image, "/camera/{camera}/image_raw", anyValue(), "Images of a camera.");
  VCHARGE_OPTION(std::string, odometry, "/odom", anyValue(), "Odometry.");
  VCHARGE_OPTION(std::string, wheel_ticks, "/wheel_ticks", anyValue(), "Wheel ticks; empty: not read.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  std::string imageTopic(const std::string& camera_name) const;
  std::string compressedImageTopic(const std::string& camera_name) const;
  /// Topic of camera_info in the namespace of the image topic, as image_transport expects it.
  std::string cameraInfoTopic(const std::string& camera_name) const;
};

}  // namespace vcharge
