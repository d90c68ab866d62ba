#include <memory>
#include <mutex>
#include <string>

#include <octomap/OcTree.h>
#include <pluginlib/class_list_macros.hpp>

#include "height_map_publication.h"
#include "vcharge_dense/height_map_output.h"
#include "vcharge_dense/height_mapper.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Builds a height map of a live or replayed drive as build_height_map does: computes range maps during the
/// drive and fuses them at the service ~finish. Writes the map to ~output and publishes it, latched, on the
/// topics of HeightMapPublication. Parameters: ~rig (path), ~output (folder), ~trajectory (TUM file,
/// otherwise odometry), ~options (HeightMapOptions), ~source (LiveDriveSourceOptions), ~lossless_replay (all
/// images in order, as build_height_map; otherwise those that wait too long are dropped).
class HeightMapNodelet : public Nodelet, private DriveConsumer {
 public:
  HeightMapNodelet() : Nodelet("height_map") {}
  ~HeightMapNodelet() override { end(); }

 private:
  using Response = std_srvs::TriggerResponse;

  void start() override {
    const std::shared_ptr<const CameraRig> rig = readRig();
    output_ = requireParameter("output", "the folder of the height map");
    const auto trajectory = parameter<std::string>("trajectory", "");
    HeightMapOptions options;
    if (!trajectory.empty()) {
      options.range_maps.plane_sweep.pose_noise = PoseNoiseOptions::trajectory();
    }
    readOptions("options", &options);
    mapper_ = std::make_unique<HeightMapper>(rig, options, output_ + ".range_maps", "");
    if (!trajectory.empty()) {
      mapper_->setTrajectory(readTrajectory(trajectory));
    }
    openSource(rig, options.range_maps.cameras);
    publication_ = std::make_unique<HeightMapPublication>(&node());
    addDiagnostics(
        "/height_map", [this] { return report(); }, Threads::kSeveral);
    serve("finish", [this](Response* response) { finish(response); });
    runSource(this);
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    guard().run([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      mapper_->addImage(camera_index, stamp, image);
    });
  }

  void addOdometry(const VehicleOdometry& odometry) override {
    guard().run([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      mapper_->addOdometry(odometry);
    });
  }

  void finish(Response* response) {
    flushSource();
    const std::lock_guard<std::mutex> lock(mutex_);
    HeightMapResult result = mapper_->finish({});
    writeHeightMapFolder(&result, output_);
    publication_->publish(result.map, result.states, result.octomap->tree());
    ContentHasher hasher;
    addToHash(result.map, &hasher);
    response->success = 1;
    response->message = output_ + ": content hash: " + hasher.hex();
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    const bool failed = guard().numFailures() > 0;
    report.level = failed ? DriveMonitor::Level::kError : DriveMonitor::Level::kOk;
    report.message = failed ? guard().lastError() : std::to_string(mapper_->numViews()) + " range maps";
    for (const RangeMapperStatus& status : mapper_->status()) {
      report.values.emplace_back(status.camera_name, status.message);
    }
    return report;
  }

  std::string output_;
  std::mutex mutex_;  // guards the mapper: services and diagnostics have their own threads
  std::unique_ptr<HeightMapper> mapper_;
  std::unique_ptr<HeightMapPublication> publication_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::HeightMapNodelet, nodelet::Nodelet)
