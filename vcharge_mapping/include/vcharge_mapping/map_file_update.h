#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_updater.h"

namespace vcharge {

/// Versions that a map file keeps if nothing else is asked for.
constexpr int kMaxMapVersions = 5;
/// Program and version that maps of live drives name.
constexpr const char* kMappingNodelet = "mapping_nodelet 0.1.0";

/// Reads a map; a session that has no name yet gets that of the recording that the map was built from.
/// Errors as those of readSparseMap().
std::shared_ptr<const SparseMap> readMapWithSessions(const std::string& path);

/// The map of a live drive, whose session is named by its last stamp.
SparseMap nameLiveDrive(const SparseMap& map);

/// Writes the map of a live drive; `provenance` has what only the caller knows. Errors as those of
/// writeSparseMap().
void writeLiveMap(const SparseMap& map, MapProvenance provenance, const std::string& path);

/// InputError, which begins with `name`, if a session of the map is the same recording.
void requireNewDrive(const SparseMap& map, const SparseMap& session, const std::string& name);

/// The updated map, and the number of its version in the file.
struct MapFileUpdate {
  UpdatedMap updated;
  int64_t version = 0;
};

/// Updates a map file by a drive, given as its map with a named session, and adds the result as a version.
/// `name`: of the session, in errors. Throws InputError, and leaves the file as it was, if another process is
/// changing it, the drive is in the map already, or the two do not fit (updateMap()).
MapFileUpdate updateMapFile(const std::string& path, const SparseMap& session, const std::string& name,
                            const std::string& program, int max_versions, const UpdateOptions& options,
                            const StageCallback& progress);

}  // namespace vcharge
