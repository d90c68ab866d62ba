#include "obstacle_publisher.h"

#include <utility>

#include <octomap/OcTree.h>

#include "bay_messages.h"
#include "corridor_messages.h"
#include "obstacle_messages.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/obstacle_conversions.h"
#include "vcharge_ros/octomap_conversions.h"

namespace vcharge {
namespace {

std::string scanFrame(const std::string& camera) {
  return "camera_" + camera + "_scan";
}

}  // namespace

ObstaclePublisher::ObstaclePublisher(ros::NodeHandle* node, std::shared_ptr<const CameraRig> rig,
                                     const std::vector<ObstacleCameraStatus>& cameras, uint32_t queue_size)
    : rig_(std::move(rig)),
      grid_(node->advertise<nav_msgs::OccupancyGrid>("/obstacles/grid", queue_size, true)),
      steps_(node->advertise<nav_msgs::OccupancyGrid>("/obstacles/steps", queue_size, true)),
      scan_(node->advertise<sensor_msgs::LaserScan>("/obstacles/scan", queue_size)),
      corridor_(node->advertise<vcharge_msgs::Corridor>("/obstacles/corridor", queue_size)),
      gaps_(node->advertise<vcharge_msgs::ParkingBays>("/parking/gaps", queue_size)),
      markers_(node->advertise<visualization_msgs::MarkerArray>("/obstacles/markers", queue_size)),
      octomap_(node->advertise<octomap_msgs::Octomap>("/obstacles/octomap", queue_size)) {
  std::vector<geometry_msgs::TransformStamped> frames;
  for (const ObstacleCameraStatus& status : cameras) {
    const std::string& name = status.camera_name;
    cameras_[name] = {
        node->advertise<sensor_msgs::LaserScan>("/obstacles/" + name + "/scan", queue_size),
        node->advertise<geometry_msgs::Vector3Stamped>("/obstacles/" + name + "/ground_plane", queue_size)};
    Eigen::Vector3d origin = rig_->cameras[rig_->cameraIndex(name)].vehicle_from_camera->translation();
    origin.z() = 0.0;
    frames.push_back(toTransformStamped(RigidTransform(Eigen::Quaterniond::Identity(), origin), Timestamp(),
                                        rig_->vehicle_frame, scanFrame(name)));
  }
  broadcaster_.sendTransform(frames);
}

void ObstaclePublisher::publish(const ObstacleFrame& frame) const {
  grid_.publish(toMessage(frame.map));
  steps_.publish(toMessage(frame.steps));
  scan_.publish(toMessage(frame.scan, rig_->vehicle_frame));
  corridor_.publish(toMessage(frame.corridor, frame.map.stamp, rig_->vehicle_frame));
  gaps_.publish(toMessage(frame.gaps, frame.map.stamp, frame.map.frame_id));
  if (markers_.getNumSubscribers() > 0) {
    visualization_msgs::MarkerArray markers = toMarkers(frame.map);
    for (visualization_msgs::Marker& strip :
         toMarkers(frame.corridor, frame.map.stamp, rig_->vehicle_frame).markers) {
      markers.markers.push_back(std::move(strip));
    }
    markers_.publish(markers);
  }
  if (octomap_.getNumSubscribers() > 0) {
    octomap_.publish(toMessage(*toOctree(frame.map), frame.map.frame_id, frame.map.stamp));
  }
  for (const CameraObstacles& obstacles : frame.cameras) {
    const Camera& camera = cameras_.at(obstacles.camera_name);
    camera.scan.publish(toMessage(obstacles.scan, scanFrame(obstacles.camera_name)));
    camera.ground.publish(toMessage(obstacles.ground, obstacles.stamp, rig_->vehicle_frame));
  }
}

}  // namespace vcharge
