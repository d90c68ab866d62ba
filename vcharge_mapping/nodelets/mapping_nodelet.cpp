#include <filesystem>
#include <memory>
#include <string>

#include <pluginlib/class_list_macros.hpp>

#include "mapping_topics.h"
#include "vcharge_core/base/error.h"
#include "vcharge_mapping/map_file_update.h"
#include "vcharge_mapping/mapping_session.h"
#include "vcharge_reconstruction/tiled_map.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Maps a live or replayed drive as build_map does, and shows it (MappingTopics). Services: ~finish starts to
/// make the map (/diagnostics tells the progress), ~save writes it, ~merge updates the map ~map by it.
/// Parameters: ~rig (path), ~output (path of the *.vmap), ~map (path; if given, the drive so far is in
/// ~output at any time, until it is merged), ~options (SparseMapperOptions), ~source
/// (LiveDriveSourceOptions), ~lossless_replay (every image in order, as build_map; otherwise those that wait
/// too long are dropped).
class MappingNodelet : public Nodelet {
 public:
  MappingNodelet() : Nodelet("mapping") {}
  ~MappingNodelet() override {
    end();
    session_.reset();  // first: its threads publish and write
  }

 private:
  using Response = std_srvs::TriggerResponse;

  void start() override {
    rig_path_ = requireParameter("rig", "the path of a rig.yaml");
    const std::shared_ptr<const CameraRig> rig = readRig();
    readOptions("options", &options_);
    session_ = std::make_unique<MappingSession>(
        rig, options_, [this](const ReconstructionState& state) { topics_->publish(state, options_); },
        [this](const SparseMap& map) { take(map); });
    keepSession();
    openSource(rig);
    topics_ = std::make_unique<MappingTopics>(&node());
    addDiagnostics(
        "/map", [this] { return toReport(session_->status()); }, Threads::kSeveral);
    serve("finish", [this](Response* response) { finish(response); });
    serve("merge", [this](Response* response) { merge(response); });
    serve("save", [this](Response* response) { save(response); });
    runSource(session_.get());
  }

  /// Keeps the drive so far in a file if there is a map to be updated by it.
  void keepSession() {
    const std::string map_path = parameter("map", std::string());
    if (map_path.empty()) {
      return;
    }
    const TiledMap readable(map_path);
    const std::string path = outputPath();
    if (std::filesystem::exists(path)) {
      throw InputError(path + ": holds a drive: update the map by it (update_map), or remove it");
    }
    kept_session_ = path;
    session_->giveParts([this](const SparseMap& map) { write(map, kept_session_); });
  }

  void take(const SparseMap& map) {
    topics_->publish(map);
    if (!kept_session_.empty()) {
      guard().run([&] { write(map, kept_session_); });
    }
  }

  void finish(Response* response) {
    flushSource();
    response->success = session_->finish(&response->message) ? 1 : 0;
  }

  void merge(Response* response) {
    const std::string path = requireParameter("map", "the path of the map to update (*.vmap)");
    const MapFileUpdate update = updateMapFile(path, nameLiveDrive(*session_->requireMap()), "the drive",
                                               kMappingNodelet, kMaxMapVersions, UpdateOptions(), nullptr);
    std::filesystem::remove(kept_session_);
    topics_->publish(*update.updated.map);
    response->success = 1;
    response->message = path + ": version " + std::to_string(update.version);
  }

  void save(Response* response) {
    const std::string path = outputPath();
    const std::shared_ptr<const SparseMap> map = session_->requireMap();
    write(*map, path);
    response->success = 1;
    response->message = path + ": content hash: " + map->contentHash();
  }

  std::string outputPath() const {
    return requireParameter("output", "the path of the map to write (*.vmap)");
  }

  void write(const SparseMap& map, const std::string& path) const {
    writeLiveMap(map, {{"rig", rig_path_}, {"mapper_options", YAML::Dump(writeFields(options_))}}, path);
  }

  std::string rig_path_, kept_session_;
  SparseMapperOptions options_;
  std::unique_ptr<MappingTopics> topics_;
  std::unique_ptr<MappingSession> session_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::MappingNodelet, nodelet::Nodelet)
