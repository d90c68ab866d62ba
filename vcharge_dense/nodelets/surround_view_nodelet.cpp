#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/Image.h>
#include <pluginlib/class_list_macros.hpp>

#include "vcharge_core/base/text_format.h"
#include "vcharge_core/workers/ordered_worker.h"
#include "vcharge_dense/surround_view.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/obstacle_conversions.h"

namespace vcharge {

/// Shows the vehicle and the ground around it from above: publishes /surround_view/image (mono8, x of the
/// vehicle frame upwards) at every stamp of the images, of a live or replayed drive. Obstacles come from
/// obstacle_nodelet's last /obstacles/grid, if it runs; which one is the last depends on its arrival, also in
/// a replay without loss. Parameters: ~rig (path), ~options (SurroundViewOptions), ~source
/// (LiveDriveSourceOptions), ~lossless_replay (every image in order; otherwise those that wait too long are
/// dropped).
class SurroundViewNodelet : public Nodelet, private DriveConsumer {
 public:
  SurroundViewNodelet() : Nodelet("surround view") {}
  ~SurroundViewNodelet() override { end(); }

 private:
  static constexpr uint32_t kOutputQueue = 2, kMaxWaitingFrames = 2;
  static constexpr const char* kGridTopic = "/obstacles/grid";
  using Task = std::function<void()>;

  void start() override {
    rig_ = readRig();
    SurroundViewOptions options;
    if (isLossless()) {
      options.frames.waitForEverything();
    }
    readOptions("options", &options);
    images_ = node().advertise<sensor_msgs::Image>("/surround_view/image", isLossless() ? 0 : kOutputQueue);
    view_ =
        std::make_unique<SurroundView>(rig_, options, [this](const SurroundFrame& frame) { publish(frame); });
    worker_ = std::make_unique<OrderedWorker<Task>>(
        [this](const Task& task) {
          guard().run([&] {
            const std::lock_guard<std::mutex> lock(mutex_);
            task();
          });
        },
        OrderedQueue<Task>(isLossless() ? 0 : kMaxWaitingFrames * rig_->cameras.size()));
    addDiagnostics(
        "/view", [this] { return report(); }, Threads::kOne);
    subscribe<nav_msgs::OccupancyGrid>(kGridTopic, 1, [this](const nav_msgs::OccupancyGridConstPtr& grid) {
      worker_->push([this, map = fromMessage(*grid, kGridTopic)] { view_->setObstacles(map); }, false);
    });
    openSource(rig_);
    runSource(this);
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    worker_->push([this, camera_index, stamp, image] { view_->addImage(camera_index, stamp, image); }, true);
  }
  void addOdometry(const VehicleOdometry& odometry) override {
    worker_->push([this, odometry] { view_->addOdometry(odometry); }, false);
  }

  void publish(const SurroundFrame& frame) {
    unknown_percent_ = 100.0 * cv::countNonZero(frame.labels == kSurroundUnknown) /
                       static_cast<double>(frame.labels.total());
    images_.publish(toImageMessage(frame.image, frame.stamp, rig_->vehicle_frame));
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    report.message = toText(unknown_percent_, 0) + " % of the view are unknown";
    report.values.emplace_back("dropped", std::to_string(worker_->numDropped()));
    addCounters(view_->counters(), &report);
    return report;
  }

  std::shared_ptr<const CameraRig> rig_;
  std::mutex mutex_;  // guards the view: diagnostics run in another thread
  ros::Publisher images_;
  double unknown_percent_ = 0.0;
  std::unique_ptr<SurroundView> view_;
  std::unique_ptr<OrderedWorker<Task>> worker_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::SurroundViewNodelet, nodelet::Nodelet)
