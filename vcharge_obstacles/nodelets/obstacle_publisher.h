#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_obstacles/obstacle_mapper.h"

namespace vcharge {

/// Publishes /obstacles/grid and /obstacles/steps (latched), /obstacles/scan, /obstacles/corridor,
/// /parking/gaps, /obstacles/markers, /obstacles/octomap, /obstacles/<camera>/scan,
/// /obstacles/<camera>/ground_plane, and the scans' frames on /tf_static.
class ObstaclePublisher {
 public:
  ObstaclePublisher(ros::NodeHandle* node, std::shared_ptr<const CameraRig> rig,
                    const std::vector<ObstacleCameraStatus>& cameras, uint32_t queue_size);

  void publish(const ObstacleFrame& frame) const;

 private:
  struct Camera {
    ros::Publisher scan, ground;
  };

  const std::shared_ptr<const CameraRig> rig_;
  ros::Publisher grid_, steps_, scan_, corridor_, gaps_, markers_, octomap_;
  std::map<std::string, Camera> cameras_;
  tf2_ros::StaticTransformBroadcaster broadcaster_;
};

}  // namespace vcharge
