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

/// The messages of depth_nodelet for one camera and stamp.
struct RangeMapParts {
  sensor_msgs::ImageConstPtr range, standard_deviation, confidence, reference;
  sensor_msgs::CameraInfoConstPtr camera_info;
  bool complete() const { return range && standard_deviation && confidence && reference && camera_info; }
};

/// Converts RangeMapParts to range maps; the working camera is built once per image size. Not thread safe.
class RangeMapReader {
 public:
  /// `topic`: common prefix of the parts' topics, for errors.
  RangeMapReader(const RigCamera& camera, std::string topic);

  /// The range map refers to the pixels of the messages, which must outlive it. InputError "<topic>/...: ..."
  /// for another encoding, images of different sizes, or a camera that is not the rig's at that size.
  RangeMap read(const RangeMapParts& parts);

 private:
  void prepare(cv::Size size);

  const RigCamera camera_;
  const std::string topic_;
  cv::Size size_;  // of the images that the members below belong to
  std::optional<MeiCamera> model_;
  sensor_msgs::CameraInfo expected_;
};

/// Cells: -1 unobserved, 0 free, 100 occupied. The frame_id and stamp are the map's.
nav_msgs::OccupancyGrid toMessage(const ObstacleMap& map);

/// Ranges are infinite for rays that are free up to the maximum, NaN for unknown ones. Intensities are
/// heights of the obstacles in metres, 0 without one. `frame_id`: frame at the scan's origin on the ground,
/// with the vehicle's axes.
sensor_msgs::LaserScan toMessage(const ObstacleScan& scan, const std::string& frame_id);

/// Outlines of the occupied cells as walls of their heights and as lines; replaces earlier markers.
visualization_msgs::MarkerArray toMarkers(const ObstacleMap& map);

/// An occupied cell becomes a column of voxels from the ground up to its height, a free one a voxel on the
/// ground. Voxels have the cells' size and alignment.
std::unique_ptr<octomap::OcTree> toOctree(const ObstacleMap& map);

/// Body over the ground as x: roll (rad), y: pitch (rad), z: height (m).
geometry_msgs::Vector3Stamped toMessage(const GroundPlane& ground, Timestamp stamp,
                                        const std::string& vehicle_frame);

}  // namespace vcharge
