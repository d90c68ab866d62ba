#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <octomap/OcTree.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>
#include <pluginlib/class_list_macros.hpp>

#include "obstacle_messages.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/workers/ordered_worker.h"
#include "vcharge_obstacles/obstacle_mapper.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/octomap_conversions.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// Obstacles and free ground around the vehicle, from depth_nodelet's /dense/<camera>/range/* and /odom.
/// Publishes /obstacles/grid, /obstacles/scan, /obstacles/markers, /obstacles/octomap,
/// /obstacles/<camera>/scan and /obstacles/<camera>/ground_plane, the scans' frames on /tf_static, and a
/// status per camera in /diagnostics. Callbacks only sort messages: all else is done in a thread of its own.
/// Parameters: ~rig (path), ~options (ObstacleMapperOptions; fixed_frame: map needs localization's map ->
/// odom on /tf), ~odometry_topic, ~lossless_replay (every range map in order, however late, as
/// detect_obstacles; otherwise those that wait too long are dropped).
class ObstacleNodelet : public Nodelet {
 public:
  ~ObstacleNodelet() override {
    diagnostics_.clear();
    subscribers_.clear();  // no callback any more, hence no task
    worker_.reset();
  }

 private:
  static constexpr size_t kMaxIncomplete = 20;
  static constexpr uint32_t kOutputQueue = 10;
  static constexpr size_t kMaxWaitingPerCamera = 2;
  using Task = std::function<void()>;
  struct Camera {
    std::unique_ptr<RangeMapReader> reader;  // of the worker's thread
    std::map<ros::Time, RangeMapParts> incomplete;
    ros::Publisher scan, ground;
  };

  void initialize() override {
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
    is_lossless_ = private_node.param("lossless_replay", false);
    if (is_lossless_) {
      options.max_wait_s = std::numeric_limits<double>::infinity();
      options.odometry.history_s = std::numeric_limits<double>::infinity();
    }
    mapper_ = std::make_unique<ObstacleMapper>(rig_, options,
                                               [this](const ObstacleFrame& frame) { publish(frame); });
    const std::vector<ObstacleCameraStatus> cameras = mapper_->status();
    worker_ = std::make_unique<OrderedWorker<Task>>(
        [](const Task& task) { task(); },
        OrderedQueue<Task>(is_lossless_ ? 0 : kMaxWaitingPerCamera * cameras.size()));
    if (options.fixed_frame == FixedFrame::kMap) {
      listener_ = std::make_unique<tf2_ros::TransformListener>(transforms_);
    }
    grid_ = node_.advertise<nav_msgs::OccupancyGrid>("/obstacles/grid", outputQueue(), true);
    scan_ = node_.advertise<sensor_msgs::LaserScan>("/obstacles/scan", outputQueue());
    markers_ = node_.advertise<visualization_msgs::MarkerArray>("/obstacles/markers", outputQueue());
    octomap_ = node_.advertise<octomap_msgs::Octomap>("/obstacles/octomap", outputQueue());
    std::vector<geometry_msgs::TransformStamped> frames;
    for (const ObstacleCameraStatus& camera : cameras) {
      addCamera(camera.camera_name, &frames);
    }
    broadcaster_ = std::make_unique<tf2_ros::StaticTransformBroadcaster>();
    broadcaster_->sendTransform(frames);
    for (const ObstacleCameraStatus& camera : cameras) {
      diagnostics_.push_back(
          std::make_unique<NodeletDiagnostics>(node_, private_node, getName() + "/" + camera.camera_name,
                                               [this, name = camera.camera_name] { return report(name); }));
    }
    subscribe<nav_msgs::Odometry>(
        odometry_topic_, [this](const nav_msgs::OdometryConstPtr& message) { addOdometry(*message); });
  }

  /// Of a replay without loss nothing that is published is dropped either.
  uint32_t outputQueue() const { return is_lossless_ ? 0 : kOutputQueue; }

  void addCamera(const std::string& name, std::vector<geometry_msgs::TransformStamped>* frames) {
    const size_t index = rig_->cameraIndex(name);
    const std::string topic = "/dense/" + name + "/range";
    Camera& camera = cameras_[index];
    camera.reader = std::make_unique<RangeMapReader>(rig_->cameras[index], topic);
    camera.scan = node_.advertise<sensor_msgs::LaserScan>("/obstacles/" + name + "/scan", outputQueue());
    camera.ground =
        node_.advertise<geometry_msgs::Vector3Stamped>("/obstacles/" + name + "/ground_plane", outputQueue());
    Eigen::Vector3d origin = rig_->cameras[index].vehicle_from_camera->translation();
    origin.z() = 0.0;
    frames->push_back(toTransformStamped(RigidTransform(Eigen::Quaterniond::Identity(), origin), Timestamp(),
                                         rig_->vehicle_frame, "camera_" + name + "_scan"));
    subscribePart<sensor_msgs::Image>(index, topic + "/image", &RangeMapParts::range);
    subscribePart<sensor_msgs::Image>(index, topic + "/standard_deviation",
                                      &RangeMapParts::standard_deviation);
    subscribePart<sensor_msgs::Image>(index, topic + "/confidence", &RangeMapParts::confidence);
    subscribePart<sensor_msgs::Image>(index, topic + "/reference", &RangeMapParts::reference);
    subscribePart<sensor_msgs::CameraInfo>(index, topic + "/camera_info", &RangeMapParts::camera_info);
  }

  template <class Message>
  void subscribe(const std::string& topic,
                 std::function<void(const boost::shared_ptr<const Message>&)> callback) {
    constexpr uint32_t kQueueSize = 500;
    subscribers_.push_back(
        node_.subscribe<Message>(topic, is_lossless_ ? 0 : kQueueSize,
                                 boost::function<void(const boost::shared_ptr<const Message>&)>(
                                     [this, callback](const boost::shared_ptr<const Message>& message) {
                                       guard_.run([&] { callback(message); });
                                     })));
  }

  template <class Message>
  void subscribePart(size_t index, const std::string& topic,
                     boost::shared_ptr<const Message> RangeMapParts::*part) {
    subscribe<Message>(topic, [this, index, part](const boost::shared_ptr<const Message>& message) {
      auto& incomplete = cameras_.at(index).incomplete;
      RangeMapParts& parts = incomplete[message->header.stamp];
      parts.*part = message;
      if (parts.complete()) {
        addTask([this, index, complete = parts] { addRangeMap(index, complete); }, true);
        incomplete.erase(message->header.stamp);
      }
      while (incomplete.size() > kMaxIncomplete) {
        incomplete.erase(incomplete.begin());
      }
    });
  }

  void addTask(Task task, bool is_droppable) {
    worker_->push(
        [this, task = std::move(task)] {
          guard_.run([&] {
            const std::lock_guard<std::mutex> lock(mutex_);
            task();
          });
        },
        is_droppable);
  }

  void addOdometry(const nav_msgs::Odometry& message) {
    const VehicleOdometry odometry = fromMessage(message, odometry_topic_, rig_->vehicle_frame);
    addTask(
        [this, odometry] {
          if (listener_ && transforms_.canTransform("map", "odom", ros::Time(0))) {
            mapper_->setMapFromOdom(
                fromMessage(transforms_.lookupTransform("map", "odom", ros::Time(0)).transform, "/tf"));
          }
          mapper_->addOdometry(odometry);
        },
        false);
  }

  void addRangeMap(size_t index, const RangeMapParts& parts) {
    mapper_->addRangeMap(cameras_.at(index).reader->read(parts));
  }

  void publish(const ObstacleFrame& frame) {
    grid_.publish(toMessage(frame.map));
    scan_.publish(toMessage(frame.scan, rig_->vehicle_frame));
    if (markers_.getNumSubscribers() > 0) {
      markers_.publish(toMarkers(frame.map));
    }
    if (octomap_.getNumSubscribers() > 0) {
      octomap_.publish(toMessage(*toOctree(frame.map), frame.map.frame_id, frame.map.stamp));
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
                       {"waiting_stamps", std::to_string(mapper_->numWaiting())},
                       {"dropped_of_all_cameras", std::to_string(worker_->numDropped())},
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
  bool is_lossless_ = false;
  std::shared_ptr<const CameraRig> rig_;
  CallbackGuard guard_{"obstacles"};
  std::mutex mutex_;  // of the mapper: diagnostics have another thread
  std::unique_ptr<ObstacleMapper> mapper_;
  std::map<size_t, Camera> cameras_;
  std::map<std::string, uint64_t> reported_failures_;
  tf2_ros::Buffer transforms_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;
  std::unique_ptr<tf2_ros::StaticTransformBroadcaster> broadcaster_;
  ros::Publisher grid_, scan_, markers_, octomap_;
  std::unique_ptr<OrderedWorker<Task>> worker_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::ObstacleNodelet, nodelet::Nodelet)
