#pragma once

#include <string>

#include <geometry_msgs/Vector3Stamped.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/camera_rig.h"
#include "vcharge_core/obstacle_map.h"
#include "vcharge_core/range_map.h"
#include "vcharge_obstacles/ground_plane.h"

namespace vcharge {

/// The three images of one stamp that depth_nodelet publishes. The pixels are not copied: the messages live
/// as long as the range map. InputError "<topic>: ..." for another encoding, size or a size that is not that
/// of a working image of the camera.
RangeMap toRangeMap(const sensor_msgs::ImageConstPtr& range, const sensor_msgs::ImageConstPtr& sigma,
                    const sensor_msgs::ImageConstPtr& confidence, const RigCamera& camera,
                    const std::string& topic);

/// -1 unobserved, 0 free, 100 occupied; frame_id and stamp of the map.
nav_msgs::OccupancyGrid toMessage(const ObstacleMap& map);

/// Ranges: of an obstacle; +infinity where all is free up to the maximum; NaN where nothing is known.
/// Intensities: height of the obstacle in metres, 0 without. `frame_id`: at the scan's origin on the ground,
/// with the vehicle's axes.
sensor_msgs::LaserScan toMessage(const ObstacleScan& scan, const std::string& frame_id);

/// Outlines of the occupied cells as walls up to their heights, and as lines; replaces those before.
visualization_msgs::MarkerArray toMarkers(const ObstacleMap& map);

/// x: roll, y: pitch (rad), z: height (m) of the body over the ground.
geometry_msgs::Vector3Stamped toMessage(const GroundPlane& ground, Timestamp stamp,
                                        const std::string& vehicle_frame);

}  // namespace vcharge
