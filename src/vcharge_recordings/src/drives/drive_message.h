#pragma once

#include <string>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_recordings/bag_reader.h"
#include "vcharge_ros/drive_item.h"

namespace vcharge::internal {

enum class DriveTopicKind { kImage, kCompressedImage, kOdometry, kWheelTicks };

/// The content of a drive's topic.
struct DriveTopicRole {
  DriveTopicKind kind;
  size_t camera_index = 0;
};

/// Message type of a topic, for example "nav_msgs/Odometry".
const char* expectedType(DriveTopicKind kind);

/// Converts a bag's message to a stamped item; images may have any size. InputError naming the bag and the
/// topic for a message that cannot be read.
DriveItem convertDriveMessage(const BagMessage& message, const DriveTopicRole& role,
                              const std::string& vehicle_frame, Timestamp* stamp);

}  // namespace vcharge::internal
