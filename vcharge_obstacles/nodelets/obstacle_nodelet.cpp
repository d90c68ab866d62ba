#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <pluginlib/class_list_macros.hpp>

#include "mapper_listener.h"
#include "obstacle_messages.h"
#include "obstacle_publisher.h"
#include "range_map_reader.h"
#include "vcharge_core/workers/ordered_worker.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Maps obstacles and free ground around the vehicle from depth_nodelet's /dense/<camera>/range/*, /odom,
/// images, and object_nodelet's objects. Publishes the topics of ObstaclePublisher and a status per camera in
/// /diagnostics. Callbacks only queue messages; a thread processes them. Parameters: ~rig (path), ~options
/// (ObstacleMapperOptions; fixed_frame: map needs map -> odom on /tf), ~odometry_topic, ~lossless_replay
/// (range maps in order, however late; cameras may lag by 25 stamps; otherwise late ones are dropped).
class ObstacleNodelet : public Nodelet {
 public:
  ObstacleNodelet() : Nodelet("obstacles") {}
  ~ObstacleNodelet() override { end(); }

 private:
  static constexpr uint32_t kOutputQueue = 10, kInputQueue = 500;
  static constexpr size_t kMaxWaitingPerCamera = 2;
  using Task = std::function<void()>;
  void start() override {
    rig_ = readRig();
    ObstacleMapperOptions options;
    if (isLossless()) {
      options.frames.waitForEverything();
    }
    readOptions("options", &options);
    odometry_topic_ = parameter("odometry_topic", odometry_topic_);
    mapper_ = std::make_unique<ObstacleMapper>(
        rig_, options, [this](const ObstacleFrame& frame) { publisher_->publish(frame); });
    const std::vector<ObstacleCameraStatus> cameras = mapper_->status();
    if (options.fixed_frame == FixedFrame::kMap) {
      listener_ = std::make_unique<tf2_ros::TransformListener>(transforms_);
    }
    publisher_ = std::make_unique<ObstaclePublisher>(&node(), rig_, cameras, isLossless() ? 0 : kOutputQueue);
    worker_ = std::make_unique<OrderedWorker<Task>>(
        [this](const Task& task) { guard().run([&] { work(task); }); },
        OrderedQueue<Task>(isLossless() ? 0 : kMaxWaitingPerCamera * cameras.size()));
    for (size_t i = 0; i < cameras.size(); ++i) {
      addDiagnostics(
          "/" + cameras[i].camera_name, [this, i] { return report(i); }, Threads::kOne);
      addCamera(cameras[i].camera_name);
    }
    inputs_ = std::make_unique<MapperListener>(
        &node(), *rig_, cameras, inputQueue(), &guard(),
        [this](auto... image) { worker_->push([=] { mapper_->addImage(image...); }, false); },
        [this](auto... objects) { worker_->push([=] { mapper_->setObjects(objects...); }, false); },
        [this](auto... next) { worker_->push([=] { mapper_->expectRangeMaps(next...); }, false); });
    subscribe<nav_msgs::Odometry>(
        odometry_topic_, inputQueue(),
        [this](const nav_msgs::OdometryConstPtr& message) { addOdometry(*message); });
  }

  uint32_t inputQueue() const { return isLossless() ? 0 : kInputQueue; }
  void addCamera(const std::string& name) {
    const std::string topic = "/dense/" + name + "/range";
    const auto reader = std::make_shared<RangeMapReader>(rig_->cameras[rig_->cameraIndex(name)], topic);
    cameras_.push_back(std::make_unique<RangeMapSubscriber>(
        &node(), topic, inputQueue(), &guard(), [this, reader](const RangeMapParts& parts) {
          worker_->push([this, reader, parts] { mapper_->addRangeMap(reader->read(parts)); }, true);
        }));
  }

  void addOdometry(const nav_msgs::Odometry& message) {
    worker_->push(
        [this, odometry = fromMessage(message, odometry_topic_, rig_->vehicle_frame)] {
          if (listener_ && transforms_.canTransform("map", "odom", ros::Time(0))) {
            mapper_->setMapFromOdom(
                fromMessage(transforms_.lookupTransform("map", "odom", ros::Time(0)).transform, "/tf"));
          }
          mapper_->addOdometry(odometry);
        },
        false);
  }

  void work(const Task& task) {
    const std::lock_guard<std::mutex> lock(mutex_);
    task();
  }

  DriveMonitor::Report report(size_t camera) {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report = toReport(mapper_->status().at(camera));
    report.values.emplace_back("waiting_stamps", std::to_string(mapper_->numWaiting()));
    report.values.emplace_back("dropped_of_all_cameras", std::to_string(worker_->numDropped()));
    report.values.emplace_back("odometry_jumps", std::to_string(mapper_->numJumps()));
    addCounters(mapper_->counters(), &report);
    return report;
  }

  std::string odometry_topic_ = "/odom";
  std::shared_ptr<const CameraRig> rig_;
  std::mutex mutex_;  // guards the mapper: diagnostics run in another thread
  std::unique_ptr<ObstaclePublisher> publisher_;
  std::unique_ptr<ObstacleMapper> mapper_;
  tf2_ros::Buffer transforms_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;
  std::unique_ptr<OrderedWorker<Task>> worker_;
  std::vector<std::unique_ptr<RangeMapSubscriber>> cameras_;
  std::unique_ptr<MapperListener> inputs_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::ObstacleNodelet, nodelet::Nodelet)
