#pragma once

#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Outlines, velocities (as far as one second takes them) and descriptions of objects for rviz, in `odom`.
/// Replaces the markers of the frame before.
visualization_msgs::MarkerArray toMarkers(const ObjectFrame& frame);

}  // namespace vcharge
