#include <map>
#include <memory>
#include <string>

#include <pluginlib/class_list_macros.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/workers/newest_first_worker.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"
#include "vcharge_ros/range_map_conversions.h"

namespace vcharge {

/// Range maps of a live or replayed drive. Publishes
/// /dense/<camera>/range/{image,confidence,standard_deviation,reference,camera_info} and
/// /dense/<camera>/points (made for subscribers only), and a status per camera in /diagnostics; nothing else
/// while the vehicle stands.
/// Parameters: ~rig (path), ~options (RangeMapperOptions), ~source (LiveDriveSourceOptions), ~lossless_replay
/// (every image in order, as compute_range_maps; otherwise the newest first, drops are counted).
class DepthNodelet : public Nodelet {
 public:
  ~DepthNodelet() override {
    diagnostics_.clear();
    source_.reset();  // no callback any more, hence no task
    worker_.reset();
  }

 private:
  static constexpr uint32_t kQueueSize = 10;  // of what is published; 0: nothing is ever dropped
  struct Output {
    std::unique_ptr<RangeMapConverter> converter;
    ros::Publisher range, confidence, standard_deviation, reference, camera_info, points;
  };

  void initialize() override {
    node_ = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    rig_ = std::make_shared<const CameraRig>(
        readCameraRig(requireStringParameter(private_node, "rig", "the path of a rig.yaml")));
    const bool lossless = private_node.param("lossless_replay", false);
    RangeMapperOptions options;
    readFieldsFromParameters(private_node, "options", &options);
    LiveDriveSourceOptions source_options;
    source_options.cameras = options.cameras;
    if (lossless) {
      source_options.takeEverything();
    }
    readFieldsFromParameters(private_node, "source", &source_options);

    if (!lossless) {
      worker_ =
          std::make_unique<NewestFirstWorker<RangeTask>>([this](const RangeTask& task) { sweep(task); });
    }
    mapper_ = std::make_unique<RangeMapper>(rig_, options, [this](RangeTask task) {
      if (worker_) {
        const size_t camera_index = task.camera_index;
        worker_->push(camera_index, std::move(task));
      } else {
        sweep(task);
      }
    });
    for (const RangeMapperStatus& status : mapper_->status()) {
      advertise(status.camera_name, lossless ? 0 : kQueueSize);
    }
    source_ = std::make_unique<LiveDriveSource>(node_, rig_, source_options);
    addDiagnostics(private_node);
    source_->run(mapper_.get(), DriveSource::ProgressCallback());
  }

  void advertise(const std::string& camera_name, uint32_t queue_size) {
    const size_t index = rig_->cameraIndex(camera_name);
    const std::string name = "/dense/" + camera_name;
    Output& output = outputs_[index];
    output.converter = std::make_unique<RangeMapConverter>(rig_->cameras[index].field_of_view_rad);
    output.range = node_.advertise<sensor_msgs::Image>(name + "/range/image", queue_size);
    output.confidence = node_.advertise<sensor_msgs::Image>(name + "/range/confidence", queue_size);
    output.standard_deviation =
        node_.advertise<sensor_msgs::Image>(name + "/range/standard_deviation", queue_size);
    output.reference = node_.advertise<sensor_msgs::Image>(name + "/range/reference", queue_size);
    output.camera_info = node_.advertise<sensor_msgs::CameraInfo>(name + "/range/camera_info", queue_size);
    output.points = node_.advertise<sensor_msgs::PointCloud2>(name + "/points", queue_size);
  }

  void addDiagnostics(const ros::NodeHandle& private_node) {
    diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(node_, private_node, getName(),
                                                                [this] { return source_->report(); }));
    const std::vector<RangeMapperStatus> all = mapper_->status();
    for (size_t i = 0; i < all.size(); ++i) {
      diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(
          node_, private_node, getName() + "/" + all[i].camera_name, [this, i] { return report(i); }));
    }
  }

  /// Of the i-th camera in use.
  DriveMonitor::Report report(size_t i) {
    const RangeMapperStatus status = mapper_->status().at(i);
    const size_t camera_index = rig_->cameraIndex(status.camera_name);
    const bool works =
        status.state == RangeMapperState::kMapping || status.state == RangeMapperState::kStanding;
    DriveMonitor::Report report;
    report.level = works ? DriveMonitor::Level::kOk : DriveMonitor::Level::kWarn;
    report.message = status.camera_name + ": " + status.message;
    if (guard_.numFailures() > reported_failures_[i]) {
      reported_failures_[i] = guard_.numFailures();
      report.level = DriveMonitor::Level::kError;
      report.message = guard_.lastError();
    }
    const auto add = [&](const char* key, uint64_t value) {
      report.values.emplace_back(key, std::to_string(value));
    };
    add("images", status.images);
    add("references", status.references);
    add("dropped", worker_ ? worker_->numDropped(camera_index) : 0);
    add("standing", status.standing);
    add("without_pose", status.without_pose);
    add("without_neighbours", status.without_neighbours);
    add("ignored_images", status.ignored_images);
    add("restarts", status.resets);
    return report;
  }

  void sweep(const RangeTask& task) {
    guard_.run([&] {
      Output& output = outputs_.at(task.camera_index);
      const RangeMap map = mapper_->sweep(task);
      const bool with_points = output.points.getNumSubscribers() > 0;
      const RangeMapMessages messages = output.converter->convert(map, task.reference.pixels, with_points);
      output.range.publish(messages.range);
      output.confidence.publish(messages.confidence);
      output.standard_deviation.publish(messages.standard_deviation);
      output.reference.publish(messages.reference);
      output.camera_info.publish(messages.camera_info);
      if (with_points) {
        output.points.publish(messages.points);
      }
    });
  }

  ros::NodeHandle node_;
  std::shared_ptr<const CameraRig> rig_;
  CallbackGuard guard_{"depth"};
  std::map<size_t, Output> outputs_;  // by camera
  std::map<size_t, uint64_t> reported_failures_;
  std::unique_ptr<RangeMapper> mapper_;
  std::unique_ptr<NewestFirstWorker<RangeTask>> worker_;
  std::unique_ptr<LiveDriveSource> source_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::DepthNodelet, nodelet::Nodelet)
