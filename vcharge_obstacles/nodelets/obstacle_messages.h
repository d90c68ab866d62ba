#pragma once

#include <memory>
#include <string>

#include <geometry_msgs/Vector3Stamped.h>
#include <sensor_msgs/LaserScan.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_ros/drive_monitor.h"

namespace octomap {
class OcTree;
}

namespace vcharge {

/// Ranges to obstacles in metres; +infinity where all is free up to the maximum range; NaN where unknown.
/// Intensities: height of the obstacle in metres, 0 without one. `frame_id` lies at the scan's origin on the
/// ground and has the vehicle's axes.
sensor_msgs::LaserScan toMessage(const ObstacleScan& scan, const std::string& frame_id);

/// Outlines of the occupied cells as walls up to their heights, and as lines; replaces earlier markers.
visualization_msgs::MarkerArray toMarkers(const ObstacleMap& map);

/// Occupied cells as columns of voxels from the ground up to their height, free cells as one voxel on the
/// ground, nothing for unobserved cells. Voxels are aligned with the cells and have their size.
std::unique_ptr<octomap::OcTree> toOctree(const ObstacleMap& map);

/// Attitude and height of the body over the ground as x: roll (rad), y: pitch (rad), z: height (m).
geometry_msgs::Vector3Stamped toMessage(const GroundPlane& ground, Timestamp stamp,
                                        const std::string& vehicle_frame);

/// The status of one camera for /diagnostics.
DriveMonitor::Report toReport(const ObstacleCameraStatus& status);

}  // namespace vcharge
