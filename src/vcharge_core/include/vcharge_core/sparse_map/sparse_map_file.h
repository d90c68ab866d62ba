#pragma once

#include <memory>
#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// A sparse map as one SQLite file, *.vmap, to be looked into with the sqlite3 shell: keyframes, landmarks
/// and loop edges as rows, the observations of each image as little-endian blobs, the rig as the text of a
/// rig.yaml, and an R*Tree of the landmarks (landmark_index, where SQLite was built with it). The schema is
/// in sparse_map_schema.h.

/// Writes the file in one transaction; what was there stays as it is until the new map is complete.
/// InputError naming the file and why (no such folder, disk full, ...).
void writeSparseMap(const SparseMap& map, const MapProvenance& provenance, const std::string& path);

/// Reads a map and checks it: version, size, structure, indices, and the hashes of all it says.
/// InputError naming the file and why it is no map or not as it was written. Exact: the content hash of the
/// result is that of the map that was written. `provenance` may be null.
std::shared_ptr<const SparseMap> readSparseMap(const std::string& path, MapProvenance* provenance = nullptr);

}  // namespace vcharge
