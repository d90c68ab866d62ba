#pragma once

#include <string>
#include <vector>

#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// Landmarks of a map as x, y, z (metres), observations (their count) and sigma_m (root of the trace of the
/// covariance, NaN where unknown), all FLOAT32. Headers are stamped 0: valid at any time.
sensor_msgs::PointCloud2 makeLandmarkCloud(const SparseMap& map, const std::string& frame_id = "map");

/// Points of a map under construction in the same form; observations and sigma_m are NaN.
sensor_msgs::PointCloud2 makeLandmarkCloud(const std::vector<Eigen::Vector3d>& positions_m,
                                           const std::string& frame_id = "map");

/// Poses of the vehicle at the keyframes, with their stamps.
nav_msgs::Path makePath(const SparseMap& map, const std::string& frame_id = "map");
/// Poses of the vehicle in `frame_id`, with their stamps.
nav_msgs::Path makePath(const Trajectory& trajectory, const std::string& frame_id = "map");

/// Two line lists between keyframes, in the namespaces "accepted" (green) and "rejected" (red and slightly
/// transparent). A list without edges has the action DELETE, to remove the edges of an earlier map.
visualization_msgs::MarkerArray makeLoopEdgeMarkers(const SparseMap& map,
                                                    const std::string& frame_id = "map");

}  // namespace vcharge
