#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <octomap/OcTree.h>
#include <pluginlib/class_list_macros.hpp>

#include "height_map_publication.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_dense/height_map_output.h"
#include "vcharge_dense/height_mapper.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// A height map of a live or replayed drive, as build_height_map makes it: range maps while it drives, and at
/// the service ~finish their fusion, which is written to ~output and published, latched, as
/// HeightMapPublication says. Parameters: ~rig (path), ~output (folder), ~trajectory (TUM file of this drive,
/// else odometry), ~options (HeightMapOptions), ~source (LiveDriveSourceOptions), ~lossless_replay (every
/// image in order, as build_height_map; otherwise those that wait too long are dropped).
class HeightMapNodelet : public Nodelet, private DriveConsumer {
 public:
  ~HeightMapNodelet() override {
    diagnostics_.clear();
    source_.reset();  // no callback any more
  }

 private:
  using Response = std_srvs::TriggerResponse;

  void initialize() override {
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    const auto rig = std::make_shared<const CameraRig>(
        readCameraRig(requireStringParameter(private_node, "rig", "the path of a rig.yaml")));
    output_ = requireStringParameter(private_node, "output", "the folder of the height map");
    const std::string trajectory = private_node.param("trajectory", std::string());
    HeightMapOptions options;
    if (!trajectory.empty()) {
      options.range_maps.plane_sweep.pose_noise = PoseNoiseOptions::trajectory();
    }
    readFieldsFromParameters(private_node, "options", &options);
    LiveDriveSourceOptions source_options;
    source_options.cameras = options.range_maps.cameras;
    if (private_node.param("lossless_replay", false)) {
      source_options.takeEverything();
    }
    readFieldsFromParameters(private_node, "source", &source_options);
    mapper_ = std::make_unique<HeightMapper>(rig, options, output_ + ".range_maps", "");
    if (!trajectory.empty()) {
      mapper_->setTrajectory(readTrajectory(trajectory));
    }
    source_ = std::make_unique<LiveDriveSource>(getNodeHandle(), rig, source_options);
    publication_ = std::make_unique<HeightMapPublication>(&getNodeHandle());
    addDiagnostics("", [this] { return source_->report(); });
    addDiagnostics("/height_map", [this] { return report(); });
    finish_ =
        advertiseTrigger(&private_node, "finish", &guard_, [this](Response* response) { finish(response); });
    source_->run(this, DriveSource::ProgressCallback());
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    guard_.run([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      mapper_->addImage(camera_index, stamp, image);
    });
  }

  void addOdometry(const VehicleOdometry& odometry) override {
    guard_.run([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      mapper_->addOdometry(odometry);
    });
  }

  void finish(Response* response) {
    source_->flush();
    const std::lock_guard<std::mutex> lock(mutex_);
    HeightMapResult result = mapper_->finish({});
    writeHeightMapFolder(&result, output_);
    publication_->publish(result.map, result.states, result.octomap->tree());
    ContentHasher hasher;
    addToHash(result.map, &hasher);
    response->success = 1;
    response->message = output_ + ": content hash: " + hasher.hex();
  }

  void addDiagnostics(const std::string& name, std::function<DriveMonitor::Report()> report) {
    diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(getMTNodeHandle(), getMTPrivateNodeHandle(),
                                                                getName() + name, std::move(report)));
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    const bool failed = guard_.numFailures() > 0;
    report.level = failed ? DriveMonitor::Level::kError : DriveMonitor::Level::kOk;
    report.message = failed ? guard_.lastError() : std::to_string(mapper_->numViews()) + " range maps";
    for (const RangeMapperStatus& status : mapper_->status()) {
      report.values.emplace_back(status.camera_name, status.message);
    }
    return report;
  }

  std::string output_;
  std::mutex mutex_;  // of the mapper: services and diagnostics have threads of their own
  std::unique_ptr<HeightMapper> mapper_;
  CallbackGuard guard_{"height_map"};
  std::unique_ptr<HeightMapPublication> publication_;
  std::unique_ptr<LiveDriveSource> source_;
  ros::ServiceServer finish_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::HeightMapNodelet, nodelet::Nodelet)
