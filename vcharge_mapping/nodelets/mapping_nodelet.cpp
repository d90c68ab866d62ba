#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Trigger.h>
#include <visualization_msgs/MarkerArray.h>
#include <pluginlib/class_list_macros.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/mapping_session.h"
#include "vcharge_reconstruction/live_view.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {

/// Maps a live or replayed drive as build_map does. Publishes the growing path and the landmarks seen last on
/// /mapping/trajectory and /mapping/landmarks, and once the map is made all of it, latched, with
/// /mapping/loop_edges, in the frame `map`. Services: ~finish begins to make the map and returns,
/// /diagnostics tells the rest; ~save writes it. Parameters: ~rig (path), ~output (path of the *.vmap),
/// ~options (SparseMapperOptions), ~source (LiveDriveSourceOptions), ~lossless_replay (every image in order,
/// as build_map; otherwise those that wait too long are dropped).
class MappingNodelet : public Nodelet {
 public:
  ~MappingNodelet() override {
    diagnostics_.clear();
    source_.reset();  // no callback any more
    session_.reset();
  }

 private:
  using Response = std_srvs::TriggerResponse;

  void initialize() override {
    ros::NodeHandle& node = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    rig_path_ = requireStringParameter(private_node, "rig", "the path of a rig.yaml");
    const auto rig = std::make_shared<const CameraRig>(readCameraRig(rig_path_));
    readFieldsFromParameters(private_node, "options", &options_);
    LiveDriveSourceOptions source_options;
    if (private_node.param("lossless_replay", false)) {
      source_options.takeEverything();
    }
    readFieldsFromParameters(private_node, "source", &source_options);
    session_ = std::make_unique<MappingSession>(
        rig, options_, [this](const ReconstructionState& state) { publish(state); },
        [this](const SparseMap& map) { publish(map); });
    source_ = std::make_unique<LiveDriveSource>(node, rig, source_options);
    // Nothing throws any more: a nodelet that does not load must leave no publisher behind.
    landmarks_ = node.advertise<sensor_msgs::PointCloud2>("/mapping/landmarks", 1, true);
    trajectory_ = node.advertise<nav_msgs::Path>("/mapping/trajectory", 1, true);
    loop_edges_ = node.advertise<visualization_msgs::MarkerArray>("/mapping/loop_edges", 1, true);
    addDiagnostics("", [this] { return source_->report(); });
    addDiagnostics("/map", [this] { return report(); });
    finish_ =
        advertiseTrigger(&private_node, "finish", &guard_, [this](Response* response) { finish(response); });
    save_ = advertiseTrigger(&private_node, "save", &guard_, [this](Response* response) { save(response); });
    source_->run(session_.get(), DriveSource::ProgressCallback());
  }

  void addDiagnostics(const std::string& name, std::function<DriveMonitor::Report()> report) {
    diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(getMTNodeHandle(), getMTPrivateNodeHandle(),
                                                                getName() + name, std::move(report)));
  }

  void finish(Response* response) {
    source_->flush();
    response->success = session_->finish(&response->message) ? 1 : 0;
  }

  void save(Response* response) {
    const std::string path =
        requireStringParameter(getPrivateNodeHandle(), "output", "the path of the map to write (*.vmap)");
    const std::shared_ptr<const SparseMap> map = session_->map();
    if (!map) {
      throw InputError("no map yet, expected one that ~finish made: " + session_->status().message);
    }
    writeSparseMap(*map,
                   {{"rig", rig_path_},
                    {"mapper_options", YAML::Dump(writeFields(options_))},
                    {"program", "mapping_nodelet 0.1.0"}},
                   path);
    response->success = 1;
    response->message = path + ": content hash: " + map->contentHash();
  }

  /// While driving; seldom enough that showing costs little.
  void publish(const ReconstructionState& state) {
    if ((ros::WallTime::now() - last_shown_).toSec() >= kShowPeriod_s) {
      last_shown_ = ros::WallTime::now();
      trajectory_.publish(makePath(keyframePath(state)));
      landmarks_.publish(makeLandmarkCloud(recentLandmarks(state, options_.triangulation, kShownKeyframes)));
    }
  }

  void publish(const SparseMap& map) {
    landmarks_.publish(makeLandmarkCloud(map));
    trajectory_.publish(makePath(map));
    loop_edges_.publish(makeLoopEdgeMarkers(map));
  }

  DriveMonitor::Report report() {
    const MappingSession::Status status = session_->status();
    DriveMonitor::Report report;
    report.level = status.failure.empty() ? DriveMonitor::Level::kOk : DriveMonitor::Level::kError;
    report.message = status.failure.empty() ? status.message : status.failure + "; " + status.message;
    for (const auto& [name, count] : status.counts) {
      report.values.emplace_back(name, std::to_string(count));
    }
    return report;
  }

  static constexpr double kShowPeriod_s = 0.5;
  static constexpr int kShownKeyframes = 20;
  std::string rig_path_;
  SparseMapperOptions options_;
  CallbackGuard guard_{"mapping"};
  ros::WallTime last_shown_;
  ros::Publisher landmarks_, trajectory_, loop_edges_;
  std::unique_ptr<MappingSession> session_;
  std::unique_ptr<LiveDriveSource> source_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
  ros::ServiceServer finish_, save_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MappingNodelet, nodelet::Nodelet)
