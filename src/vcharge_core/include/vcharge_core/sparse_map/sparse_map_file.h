#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

// A sparse map is one SQLite file, *.vmap, which can be inspected with the sqlite3 shell: sessions,
// keyframes, landmarks and loop edges as rows, the observations of each image as little-endian blobs, the rig
// as the text of a rig.yaml. The file also holds earlier versions of the map: only rows that changed are
// stored again. With a MapIndex, the newest version can be read tile by tile (map_tile_reader.h). The schema
// is in sparse_map_schema.h. Every change is made in a copy that replaces the file when it is complete, so
// that a reader goes on with the version that it opened, and a crash leaves the old file.

/// How a version of a map was made. Not part of its content hash.
using MapProvenance = std::map<std::string, std::string>;

/// A version that a map file holds.
struct MapVersion {
  int64_t number = 1;  ///< versions count from 1
  std::string content_hash;
  MapProvenance provenance;
};

/// What is written beside a map, so that places are recognized without reading it as a whole. The contents
/// are the writer's; they are read back by MapTileReader.
struct MapIndex {
  using PutRow = std::function<void(int64_t id, const std::vector<uint8_t>& features)>;

  std::map<std::string, std::string> info;
  /// Passes rows with ascending ids to a function; empty for a file without an index.
  std::function<void(const PutRow&)> writePlaceRows;
};

/// Writes a new file with one version; an older file is replaced only when the new one is complete. Throws
/// InputError naming the file and the reason (no such folder, disk full, ...).
void writeSparseMap(const SparseMap& map, const MapProvenance& provenance, const std::string& path,
                    const MapIndex& index = MapIndex());

/// Reads a version of a map, the newest if none is named, and checks the file's schema, size, structure,
/// indices and hashes. Files of schema 2 are read too. Throws InputError naming the file and the reason. The
/// content hash of the result equals that of the written map. `provenance` may be null.
std::shared_ptr<const SparseMap> readSparseMap(const std::string& path, MapProvenance* provenance = nullptr,
                                               std::optional<int64_t> version = std::nullopt);

/// The versions in a file, oldest first. Errors as those of readSparseMap().
std::vector<MapVersion> readMapVersions(const std::string& path);

/// The right to change a map file: held by one process at a time, from reading the old version to writing the
/// new one. Released by the destructor, and by the system if the process is killed.
class MapFileLock {
 public:
  /// InputError if the file does not exist, or another process is changing it.
  explicit MapFileLock(const std::string& path);
  ~MapFileLock();
  MapFileLock(const MapFileLock&) = delete;
  MapFileLock& operator=(const MapFileLock&) = delete;

  const std::string& path() const { return path_; }
  /// Locks a file that is about to replace the locked one, instead of that.
  void moveTo(const std::string& replacement);

 private:
  std::string path_;
  int descriptor_ = -1;
};

/// Adds a version to the locked file, which keeps the newest `max_versions` ones. Returns the new version's
/// number. Throws InputError naming the file and the reason; the file is unchanged then.
int64_t addMapVersion(const SparseMap& map, const MapProvenance& provenance, int max_versions,
                      MapFileLock* lock, const MapIndex& index = MapIndex());

}  // namespace vcharge
