#pragma once

#include <string>

namespace vcharge {

/// Topics of a drive. Images come raw or, where a drive has only that, from <image topic>/compressed.
struct DriveTopics {
  std::string image = "/camera/{camera}/image_raw";  ///< {camera}: the camera's name in the rig
  std::string odometry = "/odom";
  std::string wheel_ticks = "/wheel_ticks";  ///< optional in a drive; empty: not read

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("image", image);
    visit("odometry", odometry);
    visit("wheel_ticks", wheel_ticks);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field

  std::string imageTopic(const std::string& camera_name) const;
  std::string compressedImageTopic(const std::string& camera_name) const;
  /// Beside the image topic, as image_transport has it.
  std::string cameraInfoTopic(const std::string& camera_name) const;
};

}  // namespace vcharge
