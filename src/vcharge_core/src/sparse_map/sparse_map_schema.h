#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/sparse_map/sparse_map.h"

// Blobs are copied from memory without conversion.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "blobs of a map file are little-endian");

namespace vcharge::map_file {

/// PRAGMA application_id: "vcmp", at byte 68 of the file.
constexpr uint32_t kApplicationId = 0x76636d70;
/// PRAGMA user_version. Raise it with every change of the tables.
constexpr uint32_t kSchemaVersion = 2;
/// Large pages, since a map is read as a whole and its blobs are large.
constexpr int kPageSize_bytes = 16384;

struct Table {
  const char* name;
  const char* sql;
};

/// Blobs hold little-endian numbers. Covariances are row-major as in MapKeyframe and MapLandmark, NULL if
/// unknown. Transforms are target_from_source as in the structs.
inline const std::vector<Table>& tables() {
  static const std::vector<Table> kTables = {
      {"meta", "CREATE TABLE meta (key TEXT PRIMARY KEY, value ANY) STRICT"},
      {"provenance", "CREATE TABLE provenance (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT"},
      {"camera",
       "CREATE TABLE camera (id INTEGER PRIMARY KEY, name TEXT NOT NULL, mask_file TEXT NOT NULL,"
       " mask_png BLOB NOT NULL) STRICT"},
      {"keyframe",
       "CREATE TABLE keyframe (id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL,"
       " x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL,"
       " qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL, qw REAL NOT NULL,"
       " covariance_6x6_f64 BLOB) STRICT"},
      {"landmark",
       "CREATE TABLE landmark (id INTEGER PRIMARY KEY,"
       " x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL,"
       " sigma_m REAL, covariance_3x3_f64 BLOB) STRICT"},
      {"image",
       "CREATE TABLE image (id INTEGER PRIMARY KEY, keyframe INTEGER NOT NULL, camera INTEGER NOT NULL,"
       " num_observations INTEGER NOT NULL, landmarks_i32 BLOB NOT NULL, positions_px_f32 BLOB NOT NULL,"
       " descriptors BLOB NOT NULL) STRICT"},
      {"loop_edge",
       "CREATE TABLE loop_edge (id INTEGER PRIMARY KEY, first INTEGER NOT NULL, second INTEGER NOT NULL,"
       " x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL,"
       " qx REAL NOT NULL, qy REAL NOT NULL, qz REAL NOT NULL, qw REAL NOT NULL,"
       " num_inliers INTEGER NOT NULL, accepted INTEGER NOT NULL, reason TEXT NOT NULL) STRICT"},
  };
  return kTables;
}

/// Bounding boxes of landmarks: SELECT id FROM landmark_index WHERE min_x <= ... AND max_x >= ... Derived
/// data, which is not read back and not covered by a hash.
constexpr const char* kLandmarkIndexSql =
    "CREATE VIRTUAL TABLE landmark_index USING rtree(id, min_x, max_x, min_y, max_y, min_z, max_z)";

/// Hash of what SparseMap::contentHash() excludes but must be protected from damage: the rig, its masks, and
/// the provenance.
std::string attachmentsHash(const std::string& rig_text, const std::vector<std::string>& mask_files,
                            const std::vector<std::vector<uint8_t>>& mask_pngs,
                            const MapProvenance& provenance);

}  // namespace vcharge::map_file
