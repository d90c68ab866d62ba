#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/sparse_map/sparse_map_file.h"

// Blobs are copied from memory without conversion.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "blobs of a map file are little-endian");

namespace vcharge::map_file {

/// PRAGMA application_id: "vcmp", at byte 68 of the file.
constexpr uint32_t kApplicationId = 0x76636d70;
/// PRAGMA user_version. Raise it with every change of the tables.
constexpr uint32_t kSchemaVersion = 3;
/// The oldest schema that is read: one drive and one version, ids that count from 0.
constexpr uint32_t kOldestSchemaVersion = 2;
/// Large pages, since a map is read as a whole and its blobs are large.
constexpr int kPageSize_bytes = 16384;

/// A table of the newest version's rows. Since when a row is valid is in its last column, since_version. The
/// table past_<name> holds the rows of earlier versions, with one more column: until_version.
struct Table {
  const char* name;
  std::vector<const char*> columns;  ///< definitions; the first is the key

  /// CREATE TABLE of the newest rows and of the earlier ones.
  std::string sql() const;
  std::string pastSql() const;
  /// Names of the columns without since_version, separated by commas, each after `prefix`.
  std::string columnNames(const std::string& prefix = "") const;
  std::string key() const;
};

/// The tables with content. Blobs hold little-endian numbers. Covariances are row-major as in MapKeyframe and
/// MapLandmark, NULL if unknown. Transforms are target_from_source as in the structs.
const std::vector<Table>& tables();

/// The versions that the file holds; the newest is the map.
constexpr const char* kVersionSql = "CREATE TABLE version (number INTEGER PRIMARY KEY) STRICT";

/// Names and CREATE TABLE of all tables that a schema has.
std::vector<std::pair<std::string, std::string>> tablesOfSchema(uint32_t schema_version);

// Derived from the newest version, so that a map can be opened without reading it as a whole. Without these
// tables, or if they belong to another version, a map is read as a whole.

/// Squares of the x-y plane with keyframes, and the content hash of each as a map (partOf()).
constexpr const char* kTileSql =
    "CREATE TABLE tile (x INTEGER NOT NULL, y INTEGER NOT NULL, content_hash TEXT NOT NULL,"
    " PRIMARY KEY (x, y)) STRICT";
/// Rows of MapIndex::writePlaceRows, which recognizing places reads.
constexpr const char* kPlaceSql =
    "CREATE TABLE place (id INTEGER PRIMARY KEY, features BLOB NOT NULL) STRICT";
/// The key map_hash has the content hash of the map that the tables belong to, overview_hash that of
/// its overview (overviewOf()); others are of MapIndex.
constexpr const char* kIndexInfoSql =
    "CREATE TABLE index_info (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT";
constexpr const char* kMapHashKey = "map_hash";
constexpr const char* kOverviewHashKey = "overview_hash";

/// Hash of what SparseMap::contentHash() excludes but must be protected from damage: the rig, its masks, and
/// the provenance.
std::string attachmentsHash(const std::string& rig_text, const std::vector<std::string>& mask_files,
                            const std::vector<std::vector<uint8_t>>& mask_pngs,
                            const MapProvenance& provenance);

/// The schema of a file. InputError if it is no map, is truncated, or has a schema that is not read.
uint32_t checkHeader(const std::string& path);

}  // namespace vcharge::map_file
