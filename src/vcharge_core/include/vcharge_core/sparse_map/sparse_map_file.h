#pragma once

#include <memory>
#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// A sparse map is one SQLite file, *.vmap, which can be inspected with the sqlite3 shell: keyframes,
/// landmarks and loop edges as rows, the observations of each image as little-endian blobs, the rig as the
/// text of a rig.yaml, and an R*Tree of the landmarks (landmark_index, if SQLite supports it). The schema is
/// in sparse_map_schema.h.

/// Writes the file in one transaction; an older file is replaced only when the new one is complete. Throws
/// InputError naming the file and the reason (no such folder, disk full, ...).
void writeSparseMap(const SparseMap& map, const MapProvenance& provenance, const std::string& path);

/// Reads a map and checks its version, size, structure, indices and hashes. Throws InputError naming the file
/// and the reason. The content hash of the result equals that of the written map. `provenance` may be null.
std::shared_ptr<const SparseMap> readSparseMap(const std::string& path, MapProvenance* provenance = nullptr);

}  // namespace vcharge
