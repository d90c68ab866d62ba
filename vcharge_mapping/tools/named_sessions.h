#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {

/// Reads a map; a session that has no name yet gets that of the recording that the map was built from.
inline std::shared_ptr<const SparseMap> readWithSessions(const std::string& path) {
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

/// InputError, which begins with `path`, if a session of the map is the same recording.
inline void requireNewDrive(const SparseMap& map, const SparseMap& session, const std::string& path) {
  for (const MapSession& added : session.sessions()) {
    for (const MapSession& present : map.sessions()) {
      if (!added.recording_hash.empty() && added.recording_hash == present.recording_hash) {
        throw InputError(path + ": the map has this drive already: " + present.name);
      }
    }
  }
}

}  // namespace vcharge
