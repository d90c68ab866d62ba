#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nav_msgs/OccupancyGrid.h>
#include <vcharge_msgs/TrackedObjects.h>
#include <visualization_msgs/MarkerArray.h>
#include <pluginlib/class_list_macros.hpp>

#include "object_markers.h"
#include "vcharge_core/workers/ordered_worker.h"
#include "vcharge_obstacles/object_tracker.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/obstacle_conversions.h"
#include "vcharge_ros/stage_schedule.h"

namespace vcharge {

/// Follows what moves around the vehicle of a live or replayed drive. Publishes /obstacles/objects
/// (vcharge_msgs/TrackedObjects in `odom`, at every stamp of the images) and /obstacles/object_markers.
/// While the vehicle drives, objects behind obstacles of obstacle_nodelet's last /obstacles/grid are left
/// out; which grid is the last one depends on its arrival, also in a replay without loss. Parameters: ~rig
/// (path), ~options (ObjectTrackerOptions), ~source (LiveDriveSourceOptions), ~processor_budget (see
/// StageSchedule), ~lossless_replay (every image in order; otherwise those that wait too long are dropped).
class ObjectNodelet : public Nodelet, private DriveConsumer {
 public:
  ObjectNodelet() : Nodelet("objects") {}
  ~ObjectNodelet() override { end(); }

 private:
  static constexpr uint32_t kOutputQueue = 10, kMaxWaitingFrames = 2;
  static constexpr const char* kGridTopic = "/obstacles/grid";
  using Task = std::function<void()>;

  void start() override {
    rig_ = readRig();
    ObjectTrackerOptions options;
    if (isLossless()) {
      options.frames.waitForEverything();
    }
    readOptions("options", &options);
    const uint32_t queue = isLossless() ? 0 : kOutputQueue;
    objects_ = node().advertise<vcharge_msgs::TrackedObjects>("/obstacles/objects", queue);
    markers_ = node().advertise<visualization_msgs::MarkerArray>("/obstacles/object_markers", queue);
    tracker_ =
        std::make_unique<ObjectTracker>(rig_, options, [this](const ObjectFrame& frame) { publish(frame); });
    schedule_ = std::make_unique<StageSchedule>(*rig_, processorBudget());
    if (schedule_->hasLimit()) {
      tracker_->setCameraChoice([this](Timestamp stamp, const std::vector<bool>& has_image) {
        const std::vector<size_t> chosen = schedule_->choose(stamp, has_image);
        num_turns_ += chosen.size();
        return chosen;
      });
    }
    worker_ = std::make_unique<OrderedWorker<Task>>(
        [this](const Task& task) { guard().run([&] { work(task); }); },
        OrderedQueue<Task>(isLossless() ? 0 : kMaxWaitingFrames * rig_->cameras.size()));
    addDiagnostics(
        "", [this] { return report(); }, Threads::kOne);
    subscribe<nav_msgs::OccupancyGrid>(kGridTopic, 1, [this](const nav_msgs::OccupancyGridConstPtr& grid) {
      worker_->push([this, map = fromMessage(*grid, kGridTopic)] { tracker_->setObstacles(map); }, false);
    });
    openSource(rig_, options.cameras);
    runSource(this);
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    worker_->push([this, camera_index, stamp, image] { tracker_->addImage(camera_index, stamp, image); },
                  true);
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    schedule_->setOdometry(odometry);
    worker_->push([this, odometry] { tracker_->addOdometry(odometry); }, false);
  }

  void work(const Task& task) {
    schedule_->letResultsGoFirst();
    const std::lock_guard<std::mutex> lock(mutex_);
    schedule_->run([&] {
      num_turns_ = 0;
      task();
      return num_turns_;
    });
  }

  void publish(const ObjectFrame& frame) {
    num_objects_ = frame.objects.size();
    objects_.publish(toMessage(frame.objects, frame.stamp, "odom"));
    if (markers_.getNumSubscribers() > 0) {
      markers_.publish(toMarkers(frame));
    }
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    report.message = std::to_string(num_objects_) + " objects move";
    report.values.emplace_back("objects", std::to_string(num_objects_));
    report.values.emplace_back("dropped", std::to_string(worker_->numDropped()));
    schedule_->describe(*rig_, &report);
    addCounters(tracker_->counters(), &report);
    return report;
  }

  std::shared_ptr<const CameraRig> rig_;
  std::mutex mutex_;  // guards the tracker: diagnostics run in another thread
  ros::Publisher objects_, markers_;
  size_t num_objects_ = 0, num_turns_ = 0;  // the latter of the current task
  std::unique_ptr<StageSchedule> schedule_;
  std::unique_ptr<ObjectTracker> tracker_;
  std::unique_ptr<OrderedWorker<Task>> worker_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::ObjectNodelet, nodelet::Nodelet)
