#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nodelet/nodelet.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>
#include <pluginlib/class_list_macros.hpp>

#include "obstacle_messages.h"
#include "vcharge_core/error.h"
#include "vcharge_core/text_format.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// Obstacles and free ground around the vehicle, from depth_nodelet's /dense/<camera>/range/* and /odom.
/// Publishes /obstacles/grid, /obstacles/scan, /obstacles/markers, /obstacles/<camera>/scan and
/// /obstacles/<camera>/ground_plane, the scans' frames on /tf_static, and a status per camera in
/// /diagnostics. Parameters: ~rig (path), ~options (ObstacleMapperOptions; fixed_frame: map needs
/// localization's map -> odom on /tf), ~odometry_topic.
class ObstacleNodelet : public nodelet::Nodelet {
 public:
  ~ObstacleNodelet() override {
    diagnostics_.clear();
    subscribers_.clear();
  }

 private:
  static constexpr size_t kMaxIncomplete = 20;
  enum Part { kRange, kSigma, kConfidence, kNumParts };
  struct Camera {
    std::string topic;
    std::map<ros::Time, std::array<sensor_msgs::ImageConstPtr, kNumParts>> incomplete;
    ros::Publisher scan, ground;
  };

  void onInit() override {
    try {
      start();
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM(error.what());  // the manager would only tell that it did not load
      throw;
    }
  }

  void start() {
    node_ = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    rig_ = std::make_shared<const CameraRig>(
        readCameraRig(requireStringParameter(private_node, "rig", "the path of a rig.yaml")));
    ObstacleMapperOptions options;
    readFieldsFromParameters(private_node, "options", &options);
    private_node.param("odometry_topic", odometry_topic_, odometry_topic_);
    mapper_ = std::make_unique<ObstacleMapper>(rig_, options,
                                               [this](const ObstacleFrame& frame) { publish(frame); });
    if (options.fixed_frame == FixedFrame::kMap) {
      listener_ = std::make_unique<tf2_ros::TransformListener>(transforms_);
    }
    grid_ = node_.advertise<nav_msgs::OccupancyGrid>("/obstacles/grid", 5, true);
    scan_ = node_.advertise<sensor_msgs::LaserScan>("/obstacles/scan", 10);
    markers_ = node_.advertise<visualization_msgs::MarkerArray>("/obstacles/markers", 5);
    std::vector<geometry_msgs::TransformStamped> frames;
    for (const ObstacleCameraStatus& status : mapper_->status()) {
      addCamera(status.camera_name, &frames);
      diagnostics_.push_back(
          std::make_unique<NodeletDiagnostics>(node_, private_node, getName() + "/" + status.camera_name,
                                               [this, name = status.camera_name] { return report(name); }));
    }
    broadcaster_.sendTransform(frames);
    subscribers_.push_back(node_.subscribe<nav_msgs::Odometry>(
        odometry_topic_, 500,
        boost::function<void(const nav_msgs::OdometryConstPtr&)>(
            [this](const nav_msgs::OdometryConstPtr& message) { addOdometry(message); })));
  }

  void addCamera(const std::string& name, std::vector<geometry_msgs::TransformStamped>* frames) {
    const size_t index = rig_->cameraIndex(name);
    Camera& camera = cameras_[index];
    camera.topic = "/dense/" + name + "/range";
    camera.scan = node_.advertise<sensor_msgs::LaserScan>("/obstacles/" + name + "/scan", 10);
    camera.ground =
        node_.advertise<geometry_msgs::Vector3Stamped>("/obstacles/" + name + "/ground_plane", 10);
    Eigen::Vector3d origin = rig_->cameras[index].vehicle_from_camera->translation();
    origin.z() = 0.0;
    frames->push_back(toTransformStamped(RigidTransform(Eigen::Quaterniond::Identity(), origin), Timestamp(),
                                         rig_->vehicle_frame, "camera_" + name + "_scan"));
    const char* const parts[kNumParts] = {"image", "standard_deviation", "confidence"};
    for (int part = 0; part < kNumParts; ++part) {
      subscribers_.push_back(node_.subscribe<sensor_msgs::Image>(
          camera.topic + "/" + parts[part], 10,
          boost::function<void(const sensor_msgs::ImageConstPtr&)>(
              [this, index, part](const sensor_msgs::ImageConstPtr& message) {
                guard_.run([&] { addImage(index, part, message); });
              })));
    }
  }

  void addOdometry(const nav_msgs::OdometryConstPtr& message) {
    guard_.run([&] {
      const VehicleOdometry odometry = fromMessage(*message, odometry_topic_, rig_->vehicle_frame);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (listener_ && transforms_.canTransform("map", "odom", ros::Time(0))) {
        mapper_->setMapFromOdom(
            fromMessage(transforms_.lookupTransform("map", "odom", ros::Time(0)).transform, "/tf"));
      }
      mapper_->addOdometry(odometry);
    });
  }

  void addImage(size_t index, int part, const sensor_msgs::ImageConstPtr& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    Camera& camera = cameras_.at(index);
    auto& images = camera.incomplete[message->header.stamp];
    images[static_cast<size_t>(part)] = message;
    if (images[kRange] && images[kSigma] && images[kConfidence]) {
      const auto complete = images;  // erased also when one of them turns out to be bad
      camera.incomplete.erase(message->header.stamp);
      mapper_->addRangeMap(toRangeMap(complete[kRange], complete[kSigma], complete[kConfidence],
                                      rig_->cameras[index], camera.topic));
    }
    while (camera.incomplete.size() > kMaxIncomplete) {
      camera.incomplete.erase(camera.incomplete.begin());
    }
  }

  void publish(const ObstacleFrame& frame) {
    grid_.publish(toMessage(frame.map));
    scan_.publish(toMessage(frame.scan, rig_->vehicle_frame));
    if (markers_.getNumSubscribers() > 0) {
      markers_.publish(toMarkers(frame.map));
    }
    for (const CameraObstacles& seen : frame.cameras) {
      const Camera& camera = cameras_.at(rig_->cameraIndex(seen.camera_name));
      camera.scan.publish(toMessage(seen.scan, "camera_" + seen.camera_name + "_scan"));
      camera.ground.publish(toMessage(seen.ground, seen.stamp, rig_->vehicle_frame));
    }
  }

  DriveMonitor::Report report(const std::string& camera_name) {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    for (const ObstacleCameraStatus& status : mapper_->status()) {
      if (status.camera_name != camera_name) {
        continue;
      }
      const bool works =
          status.state == ObstacleCameraState::kMapping || status.state == ObstacleCameraState::kStanding;
      report.level = works ? DriveMonitor::Level::kOk : DriveMonitor::Level::kWarn;
      report.message = camera_name + ": " + status.message;
      report.values = {{"state", toString(status.state)},
                       {"range_maps", std::to_string(status.range_maps)},
                       {"without_pose", std::to_string(status.without_pose)},
                       {"late", std::to_string(status.late)},
                       {"odometry_jumps", std::to_string(mapper_->numJumps())},
                       {"ground", toString(status.ground.state)},
                       {"pitch_rad", toText(status.ground.pitch_rad(), 4)},
                       {"roll_rad", toText(status.ground.roll_rad(), 4)},
                       {"height_m", toText(status.ground.height_m(), 3)}};
    }
    if (guard_.numFailures() > reported_failures_[camera_name]) {
      reported_failures_[camera_name] = guard_.numFailures();
      report.level = DriveMonitor::Level::kError;
      report.message = guard_.lastError();
    }
    return report;
  }

  ros::NodeHandle node_;
  std::string odometry_topic_ = "/odom";
  std::shared_ptr<const CameraRig> rig_;
  CallbackGuard guard_{"obstacles"};
  std::mutex mutex_;  // of the mapper and the cameras' parts
  std::unique_ptr<ObstacleMapper> mapper_;
  std::map<size_t, Camera> cameras_;
  std::map<std::string, uint64_t> reported_failures_;
  tf2_ros::Buffer transforms_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;
  tf2_ros::StaticTransformBroadcaster broadcaster_;
  ros::Publisher grid_, scan_, markers_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::ObstacleNodelet, nodelet::Nodelet)
