#pragma once

#include <memory>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/transform_broadcaster.h>
#include <vcharge_msgs/LocalizationStatus.h>

#include "vcharge_localization/drive_localizer.h"

namespace vcharge {

/// Publishes results: /localization/status for each; /localization/observations (markers) if somebody
/// listens; with a pose, /localization/pose, and map -> odom on /tf.
class LocalizationTopics {
 public:
  LocalizationTopics(ros::NodeHandle* node, std::string map_frame, std::string odom_frame);
  /// Returns the published status.
  vcharge_msgs::LocalizationStatus publish(const LocalizationResult& result, const CameraRig& rig);

 private:
  const std::string map_frame_, odom_frame_;
  ros::Publisher pose_, status_, observations_;
  tf2_ros::TransformBroadcaster broadcaster_;
};

}  // namespace vcharge
