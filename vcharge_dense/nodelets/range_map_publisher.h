#pragma once

#include <string>

#include <ros/node_handle.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_ros/range_map_conversions.h"

namespace vcharge {

/// Publishes one camera's range maps on
/// /dense/<camera>/range/{image,confidence,standard_deviation,reference,camera_info} and
/// /dense/<camera>/points; the points are computed only if somebody subscribes. Not thread safe.
class RangeMapPublisher {
 public:
  RangeMapPublisher(ros::NodeHandle* node, const RigCamera& camera, uint32_t queue_size)
      : converter_(camera.field_of_view_rad) {
    const std::string name = "/dense/" + camera.name;
    range_ = node->advertise<sensor_msgs::Image>(name + "/range/image", queue_size);
    confidence_ = node->advertise<sensor_msgs::Image>(name + "/range/confidence", queue_size);
    standard_deviation_ = node->advertise<sensor_msgs::Image>(name + "/range/standard_deviation", queue_size);
    reference_ = node->advertise<sensor_msgs::Image>(name + "/range/reference", queue_size);
    camera_info_ = node->advertise<sensor_msgs::CameraInfo>(name + "/range/camera_info", queue_size);
    points_ = node->advertise<sensor_msgs::PointCloud2>(name + "/points", queue_size);
  }

  void publish(const RangeMap& map) {
    const bool with_points = points_.getNumSubscribers() > 0;
    const RangeMapMessages messages = converter_.convert(map, map.reference, with_points);
    range_.publish(messages.range);
    confidence_.publish(messages.confidence);
    standard_deviation_.publish(messages.standard_deviation);
    reference_.publish(messages.reference);
    camera_info_.publish(messages.camera_info);
    if (with_points) {
      points_.publish(messages.points);
    }
  }

 private:
  RangeMapConverter converter_;
  ros::Publisher range_, confidence_, standard_deviation_, reference_, camera_info_, points_;
};

}  // namespace vcharge
