#include "vcharge_mapping/map_file_update.h"

#include <filesystem>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/utc_time.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace vcharge {
namespace {

std::string nameOfLiveDrive(const SparseMap& map) {
  return "live until " + toString(map.keyframes().back().stamp) + " s";
}

}  // namespace

std::shared_ptr<const SparseMap> readMapWithSessions(const std::string& path) {
  MapProvenance provenance;
  const std::shared_ptr<const SparseMap> map = readSparseMap(path, &provenance);
  SparseMapContents contents = map->contents();
  for (MapSession& session : contents.sessions) {
    if (session.name.empty()) {
      session.name = std::filesystem::path(provenance["bag"]).filename().string();
      session.recording_hash = provenance["bag_hash"];
    }
  }
  return std::make_shared<const SparseMap>(std::move(contents));
}

SparseMap nameLiveDrive(const SparseMap& map) {
  SparseMapContents contents = map.contents();
  contents.sessions.front().name = nameOfLiveDrive(map);
  contents.sessions.front().recording_hash = map.contentHash();
  return SparseMap(std::move(contents));
}

void writeLiveMap(const SparseMap& map, MapProvenance provenance, const std::string& path) {
  provenance["bag"] = nameOfLiveDrive(map);
  provenance["bag_hash"] = map.contentHash();
  provenance["program"] = kMappingNodelet;
  writeSparseMap(map, provenance, path, indexForTiles(map));
}

void requireNewDrive(const SparseMap& map, const SparseMap& session, const std::string& name) {
  for (const MapSession& added : session.sessions()) {
    for (const MapSession& present : map.sessions()) {
      if (!added.recording_hash.empty() && added.recording_hash == present.recording_hash) {
        throw InputError(name + ": the map has this drive already: " + present.name);
      }
    }
  }
}

MapFileUpdate updateMapFile(const std::string& path, const SparseMap& session, const std::string& name,
                            const std::string& program, int max_versions, const UpdateOptions& options,
                            const StageCallback& progress) {
  MapFileLock lock(path);
  const std::shared_ptr<const SparseMap> map = readMapWithSessions(path);
  requireSameRig(*map, session, name);
  requireNewDrive(*map, session, name);
  MapFileUpdate update;
  update.updated = updateMap(*map, session, options, progress);
  const std::string& drive = session.sessions().front().name;
  update.version = addMapVersion(
      *update.updated.map,
      {{"bag", drive}, {"program", program}, {"date", utcNow()}, {"change", "updated by " + drive}},
      max_versions, &lock, indexForTiles(*update.updated.map));
  return update;
}

}  // namespace vcharge
