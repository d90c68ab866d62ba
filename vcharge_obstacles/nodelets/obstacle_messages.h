#pragma once

#include <memory>
#include <optional>
#include <string>

#include <geometry_msgs/Vector3Stamped.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_obstacles/ground_plane.h"

namespace octomap {
class OcTree;
}

namespace vcharge {

/// What depth_nodelet publishes of one camera at one stamp.
struct RangeMapParts {
  sensor_msgs::ImageConstPtr range, standard_deviation, confidence, reference;
  sensor_msgs::CameraInfoConstPtr camera_info;
  bool complete() const { return range && standard_deviation && confidence && reference && camera_info; }
};

/// Turns them into range maps; the working camera is built once for all images of a size. Not thread safe.
class RangeMapReader {
 public:
  /// `topic` stands in errors: that of the parts without their own names.
  RangeMapReader(const RigCamera& camera, std::string topic);

  /// The range map's pixels are those of the messages, which must outlive it. InputError "<topic>/...: ..."
  /// for another encoding, images of unlike size, or a camera that is not the rig's at that size.
  RangeMap read(const RangeMapParts& parts);

 private:
  void prepare(cv::Size size);

  const RigCamera camera_;
  const std::string topic_;
  cv::Size size_;  // of the two below
  std::optional<MeiCamera> model_;
  sensor_msgs::CameraInfo expected_;
};

/// -1 unobserved, 0 free, 100 occupied; frame_id and stamp of the map.
nav_msgs::OccupancyGrid toMessage(const ObstacleMap& map);

/// Ranges: of an obstacle; +infinity where all is free up to the maximum; NaN where nothing is known.
/// Intensities: height of the obstacle in metres, 0 without. `frame_id`: at the scan's origin on the ground,
/// with the vehicle's axes.
sensor_msgs::LaserScan toMessage(const ObstacleScan& scan, const std::string& frame_id);

/// Outlines of the occupied cells as walls up to their heights, and as lines; replaces those before.
visualization_msgs::MarkerArray toMarkers(const ObstacleMap& map);

/// Occupied cells as columns of voxels from the ground up to their height, free ones as one voxel on the
/// ground, unobserved ones as nothing. Voxels are as large as cells, and lie in their places.
std::unique_ptr<octomap::OcTree> toOctree(const ObstacleMap& map);

/// x: roll, y: pitch (rad), z: height (m) of the body over the ground.
geometry_msgs::Vector3Stamped toMessage(const GroundPlane& ground, Timestamp stamp,
                                        const std::string& vehicle_frame);

}  // namespace vcharge
