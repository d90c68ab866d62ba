#pragma once

#include <string>

#include <geometry_msgs/Point.h>
#include <visualization_msgs/Marker.h>
#include <Eigen/Core>

#include "vcharge_ros/conversions.h"

namespace vcharge {

inline geometry_msgs::Point pointOf(const Eigen::Vector2d& position_m, double z_m) {
  geometry_msgs::Point point;
  point.x = position_m.x();
  point.y = position_m.y();
  point.z = z_m;
  return point;
}

/// A marker to add at the origin of its frame, opaque and black. `kind`: namespace of the markers of one
/// sort.
inline visualization_msgs::Marker makeMarker(Timestamp stamp, const std::string& frame_id,
                                             const std::string& kind, int type) {
  visualization_msgs::Marker marker;
  marker.header.stamp = fromTimestamp(stamp);
  marker.header.frame_id = frame_id;
  marker.ns = kind;
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.color.a = 1.0F;
  return marker;
}

}  // namespace vcharge
