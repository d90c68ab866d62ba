#pragma once

#include <cstdint>
#include <string>

#include "sparse_map/sparse_map_schema.h"
#include "sparse_map/sqlite_database.h"

namespace vcharge::map_file {

/// Makes an empty database a map file with this map as its first version.
void writeFirstVersion(const SparseMap& map, const MapProvenance& provenance, const MapIndex& index,
                       SqliteDatabase* database);

/// Writes the rows of a map into the tables named <prefix><table>, valid since `version`.
void writeRows(const SparseMap& map, const MapProvenance& provenance, const std::string& prefix,
               int64_t version, SqliteDatabase* database);

/// Replaces the tables of the index.
void writeIndex(const SparseMap& map, const MapIndex& index, SqliteDatabase* database);

}  // namespace vcharge::map_file
