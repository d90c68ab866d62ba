#include "drives/drive_message.h"

#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge::internal {
const char* expectedType(DriveTopicKind kind) {
  switch (kind) {
    case DriveTopicKind::kImage:
      return "sensor_msgs/Image";
    case DriveTopicKind::kCompressedImage:
      return "sensor_msgs/CompressedImage";
    case DriveTopicKind::kOdometry:
      return "nav_msgs/Odometry";
    default:
      return "vcharge_msgs/WheelTicks";
  }
}

DriveItem convertDriveMessage(const BagMessage& message, const DriveTopicRole& role,
                              const std::string& vehicle_frame, Timestamp* stamp) {
  const std::string& source = message.source();
  switch (role.kind) {
    case DriveTopicKind::kOdometry: {
      const auto odometry = message.instantiate<nav_msgs::Odometry>();
      *stamp = toTimestamp(odometry->header.stamp);
      return fromMessage(*odometry, source, vehicle_frame);
    }
    case DriveTopicKind::kWheelTicks: {
      const auto ticks = message.instantiate<vcharge_msgs::WheelTicks>();
      *stamp = toTimestamp(ticks->header.stamp);
      return fromMessage(*ticks, source);
    }
    case DriveTopicKind::kImage: {
      const sensor_msgs::ImageConstPtr raw = message.instantiate<sensor_msgs::Image>();
      *stamp = toTimestamp(raw->header.stamp);
      return CameraImage{role.camera_index, toImage(raw, source)};
    }
    default: {
      const sensor_msgs::CompressedImageConstPtr compressed =
          message.instantiate<sensor_msgs::CompressedImage>();
      *stamp = toTimestamp(compressed->header.stamp);
      return CameraImage{role.camera_index, toImage(compressed, source)};
    }
  }
}

}  // namespace vcharge::internal
