#include <memory>
#include <string>

#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>
#include <pluginlib/class_list_macros.hpp>

#include "vcharge_mapping/map_file_update.h"
#include "vcharge_mapping/mapping_session.h"
#include "vcharge_reconstruction/live_view.h"
#include "vcharge_reconstruction/tiled_map.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {

/// Maps a live or replayed drive as build_map does. Publishes the growing path and the newest landmarks on
/// /mapping/trajectory and /mapping/landmarks; once the map is made, the whole map, latched, with
/// /mapping/loop_edges, in the frame `map`. Services: ~finish starts to make the map (/diagnostics tells the
/// progress), ~save writes it, ~merge updates the map file by it. Parameters: ~rig (path), ~output (path of
/// the *.vmap), ~options (SparseMapperOptions), ~source (LiveDriveSourceOptions), ~lossless_replay (every
/// image in order, as build_map; otherwise those that wait too long are dropped).
class MappingNodelet : public Nodelet {
 public:
  MappingNodelet() : Nodelet("mapping") {}
  ~MappingNodelet() override {
    end();
    session_.reset();  // first: its thread publishes
  }

 private:
  using Response = std_srvs::TriggerResponse;

  void start() override {
    rig_path_ = requireParameter("rig", "the path of a rig.yaml");
    const std::shared_ptr<const CameraRig> rig = readRig();
    readOptions("options", &options_);
    session_ = std::make_unique<MappingSession>(
        rig, options_, [this](const ReconstructionState& state) { publish(state); },
        [this](const SparseMap& map) { publish(map); });
    openSource(rig);
    landmarks_ = advertiseLatched<sensor_msgs::PointCloud2>("/mapping/landmarks");
    trajectory_ = advertiseLatched<nav_msgs::Path>("/mapping/trajectory");
    loop_edges_ = advertiseLatched<visualization_msgs::MarkerArray>("/mapping/loop_edges");
    addDiagnostics(
        "/map", [this] { return report(); }, Threads::kSeveral);
    serve("finish", [this](Response* response) { finish(response); });
    serve("merge", [this](Response* response) { merge(response); });
    serve("save", [this](Response* response) { save(response); });
    runSource(session_.get());
  }

  void finish(Response* response) {
    flushSource();
    response->success = session_->finish(&response->message) ? 1 : 0;
  }

  void merge(Response* response) {
    const std::string path = requireParameter("output", "the path of the map to update (*.vmap)");
    const MapFileUpdate update =
        updateMapFile(path, nameLiveDrive(*session_->requireMap()), "the drive", "mapping_nodelet 0.1.0",
                      kMaxMapVersions, UpdateOptions(), nullptr);
    publish(*update.updated.map);
    response->success = 1;
    response->message = path + ": version " + std::to_string(update.version);
  }

  void save(Response* response) {
    const std::string path = requireParameter("output", "the path of the map to write (*.vmap)");
    const std::shared_ptr<const SparseMap> map = session_->requireMap();
    writeSparseMap(*map,
                   {{"rig", rig_path_},
                    {"bag_hash", map->contentHash()},
                    {"mapper_options", YAML::Dump(writeFields(options_))},
                    {"program", "mapping_nodelet 0.1.0"}},
                   path, indexForTiles(*map));
    response->success = 1;
    response->message = path + ": content hash: " + map->contentHash();
  }

  /// Called during the drive; publishes at most twice a second to keep the cost low.
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
  ros::WallTime last_shown_;
  ros::Publisher landmarks_, trajectory_, loop_edges_;
  std::unique_ptr<MappingSession> session_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MappingNodelet, nodelet::Nodelet)
