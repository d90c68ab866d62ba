#pragma once

#include <functional>
#include <string>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/recorded_drive.h"
#include "vcharge_ros/drive_topics.h"

namespace vcharge {

/// Delivers all images and the odometry of a bag in the order of recording. Missing topics are ignored;
/// messages that cannot be read are reported to the consumer. `progress` (may be empty) receives the fraction
/// done. InputError for a file that is not a bag, or that is truncated.
void readRecordedDrive(const std::string& bag_path, const CameraRig& rig, const DriveTopics& topics,
                       RecordedDriveConsumer* consumer, const std::function<void(double)>& progress);

}  // namespace vcharge
