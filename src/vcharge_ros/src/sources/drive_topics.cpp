#include "vcharge_ros/drive_topics.h"

#include <stdexcept>

namespace vcharge {
namespace {

constexpr char kPlaceholder[] = "{camera}";

}  // namespace

void DriveTopics::checkFields() const {
  if (image.find(kPlaceholder) == std::string::npos) {
    throw std::invalid_argument("image: must contain {camera}, is '" + image + "'");
  }
  if (odometry.empty()) {
    throw std::invalid_argument("odometry: must name a topic, is empty");
  }
}

std::string DriveTopics::imageTopic(const std::string& camera_name) const {
  std::string topic = image;
  const size_t position = topic.find(kPlaceholder);
  return position == std::string::npos ? topic
                                       : topic.replace(position, sizeof(kPlaceholder) - 1, camera_name);
}

std::string DriveTopics::compressedImageTopic(const std::string& camera_name) const {
  return imageTopic(camera_name) + "/compressed";
}

std::string DriveTopics::cameraInfoTopic(const std::string& camera_name) const {
  const std::string topic = imageTopic(camera_name);
  const size_t slash = topic.rfind('/');
  return (slash == std::string::npos ? std::string() : topic.substr(0, slash + 1)) + "camera_info";
}

}  // namespace vcharge
