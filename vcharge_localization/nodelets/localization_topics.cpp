#include "localization_topics.h"

#include <utility>

#include "localization_messages.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {

LocalizationTopics::LocalizationTopics(ros::NodeHandle* node, std::string map_frame, std::string odom_frame)
    : map_frame_(std::move(map_frame)),
      odom_frame_(std::move(odom_frame)),
      pose_(node->advertise<geometry_msgs::PoseWithCovarianceStamped>("/localization/pose", 10)),
      status_(node->advertise<vcharge_msgs::LocalizationStatus>("/localization/status", 10)),
      observations_(node->advertise<visualization_msgs::Marker>("/localization/observations", 2)) {}

vcharge_msgs::LocalizationStatus LocalizationTopics::publish(const LocalizationResult& result,
                                                             const CameraRig& rig) {
  vcharge_msgs::LocalizationStatus status = toStatusMessage(result, rig, map_frame_);
  status_.publish(status);
  if (observations_.getNumSubscribers() > 0) {
    observations_.publish(toObservationMarker(result, rig, map_frame_));
  }
  if (result.pose) {
    pose_.publish(toPoseMessage(result, map_frame_));
    if (result.odom_from_vehicle) {
      broadcaster_.sendTransform(
          toTransformStamped(result.pose->map_from_vehicle * result.odom_from_vehicle->inverse(),
                             result.stamp, map_frame_, odom_frame_));
    }
  }
  return status;
}

}  // namespace vcharge
