#pragma once

#include <string>
#include <vector>

#include <nav_msgs/OccupancyGrid.h>
#include <vcharge_msgs/TrackedObjects.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/step_map.h"
#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Converts objects given in the frame `frame_id`; footprints are rounded to float.
vcharge_msgs::TrackedObjects toMessage(const std::vector<TrackedObject>& objects, Timestamp stamp,
                                       const std::string& frame_id);

/// Inverse of toMessage(). InputError that begins with `source` for a number that is not finite, or an
/// unknown class.
std::vector<TrackedObject> fromMessage(const vcharge_msgs::TrackedObjects& message,
                                       const std::string& source);

/// Cells: -1 unobserved, 0 free, 100 occupied. frame_id and stamp are the map's.
nav_msgs::OccupancyGrid toMessage(const ObstacleMap& map);

/// The states of the cells; pose, heights, points and ages are unknown. InputError that names the topic
/// unless the grid has a stamp, a frame, a resolution, an origin without rotation, and as many cells as it
/// says.
ObstacleMap fromMessage(const nav_msgs::OccupancyGrid& grid, const std::string& topic);

/// Cells: -1 unknown, 0 even, 100 step. frame_id and stamp are the map's.
nav_msgs::OccupancyGrid toMessage(const StepMap& map);

}  // namespace vcharge
