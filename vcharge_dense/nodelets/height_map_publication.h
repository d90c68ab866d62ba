#pragma once

#include <nav_msgs/OccupancyGrid.h>
#include <octomap_msgs/Octomap.h>
#include <ros/node_handle.h>

#include "vcharge_ros/height_map_conversions.h"
#include "vcharge_ros/octomap_conversions.h"

namespace vcharge {

/// The latched topics of a height map: /dense/height_map with /points, /grid and /mesh below it, and
/// /dense/octomap (and its occupied voxels as a marker, /dense/octomap/occupied). A latched message lives as
/// long as this object.
class HeightMapPublication {
 public:
  explicit HeightMapPublication(ros::NodeHandle* node)
      : map_(node->advertise<vcharge_msgs::HeightMap>("/dense/height_map", 1, true)),
        points_(node->advertise<sensor_msgs::PointCloud2>("/dense/height_map/points", 1, true)),
        grid_(node->advertise<nav_msgs::OccupancyGrid>("/dense/height_map/grid", 1, true)),
        mesh_(node->advertise<visualization_msgs::Marker>("/dense/height_map/mesh", 1, true)),
        octomap_(node->advertise<octomap_msgs::Octomap>("/dense/octomap", 1, true)),
        occupied_(node->advertise<visualization_msgs::Marker>("/dense/octomap/occupied", 1, true)) {}

  /// The stamp is 0: the map is valid at any time.
  void publish(const HeightMap& map, const cv::Mat& states, const octomap::OcTree& tree) {
    const Timestamp always = Timestamp::fromNanoseconds(0);
    map_.publish(toMessage(map, always));
    points_.publish(makeHeightCloud(map, always));
    grid_.publish(makeOccupancyGrid(map, states, always));
    mesh_.publish(makeHeightMesh(map, always));
    octomap_.publish(toMessage(tree, map.frame_id, always));
    occupied_.publish(makeOctomapMarker(tree, map.frame_id, always));
  }

 private:
  ros::Publisher map_, points_, grid_, mesh_, octomap_, occupied_;
};

}  // namespace vcharge
