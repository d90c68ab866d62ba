#include "drive_message.h"

#include "bag_access.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge::internal {
namespace {

template <class Message>
boost::shared_ptr<Message> instantiate(const rosbag::MessageInstance& message, const std::string& bag_path) {
  const boost::shared_ptr<Message> result =
      readingBag(bag_path, [&] { return message.instantiate<Message>(); });
  if (!result) {
    throw InputError(bag_path + ": " + message.getTopic() + ": expected the message definition of " +
                     ros::message_traits::datatype<Message>() +
                     " that this program was built with, got another");
  }
  return result;
}

}  // namespace

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

DriveItem convertDriveMessage(const rosbag::MessageInstance& message, const DriveTopicRole& role,
                              const std::string& bag_path, const std::string& vehicle_frame,
                              Timestamp* stamp) {
  const std::string source = bag_path + ": " + message.getTopic();
  switch (role.kind) {
    case DriveTopicKind::kOdometry: {
      const auto odometry = instantiate<nav_msgs::Odometry>(message, bag_path);
      *stamp = toTimestamp(odometry->header.stamp);
      return fromMessage(*odometry, source, vehicle_frame);
    }
    case DriveTopicKind::kWheelTicks: {
      const auto ticks = instantiate<vcharge_msgs::WheelTicks>(message, bag_path);
      *stamp = toTimestamp(ticks->header.stamp);
      return fromMessage(*ticks, source);
    }
    case DriveTopicKind::kImage: {
      const sensor_msgs::ImageConstPtr raw = instantiate<sensor_msgs::Image>(message, bag_path);
      *stamp = toTimestamp(raw->header.stamp);
      return CameraImage{role.camera_index, toImage(raw, source)};
    }
    default: {
      const sensor_msgs::CompressedImageConstPtr compressed =
          instantiate<sensor_msgs::CompressedImage>(message, bag_path);
      *stamp = toTimestamp(compressed->header.stamp);
      return CameraImage{role.camera_index, toImage(compressed, source)};
    }
  }
}

}  // namespace vcharge::internal
