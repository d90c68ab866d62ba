#include "sparse_map/sparse_map_schema.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge::map_file {
namespace {

namespace fs = std::filesystem;

uint32_t bigEndian(const char* bytes, int count) {
  uint32_t value = 0;
  for (int i = 0; i < count; ++i) {
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

/// A column's name, which its definition begins with.
std::string nameOf(const std::string& definition) {
  return definition.substr(0, definition.find(' '));
}

std::string createTable(const std::string& name, const std::vector<std::string>& columns) {
  std::string sql = "CREATE TABLE " + name + " (";
  for (size_t i = 0; i < columns.size(); ++i) {
    sql += (i == 0 ? "" : ", ") + columns[i];
  }
  return sql + ") STRICT";
}

/// The tables of schema 2.
const std::vector<std::pair<std::string, std::string>>& tablesOfSchema2() {
  static const std::vector<std::pair<std::string, std::string>> kTables = {
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
       " num_inliers INTEGER NOT NULL, accepted INTEGER NOT NULL, reason TEXT NOT NULL) STRICT"}};
  return kTables;
}

}  // namespace

const std::vector<Table>& tables() {
  static const std::vector<Table> kTables = {
      {"meta", {"key TEXT PRIMARY KEY", "value ANY"}},
      {"provenance", {"key TEXT PRIMARY KEY", "value TEXT NOT NULL"}},
      {"camera",
       {"id INTEGER PRIMARY KEY", "name TEXT NOT NULL", "mask_file TEXT NOT NULL", "mask_png BLOB NOT NULL"}},
      {"session",
       {"id INTEGER PRIMARY KEY", "name TEXT NOT NULL", "recording_hash TEXT NOT NULL",
        "component INTEGER NOT NULL"}},
      {"keyframe",
       {"id INTEGER PRIMARY KEY", "session INTEGER NOT NULL", "stamp_ns INTEGER NOT NULL",
        "x_m REAL NOT NULL", "y_m REAL NOT NULL", "z_m REAL NOT NULL", "qx REAL NOT NULL", "qy REAL NOT NULL",
        "qz REAL NOT NULL", "qw REAL NOT NULL", "covariance_6x6_f64 BLOB"}},
      {"landmark",
       {"id INTEGER PRIMARY KEY", "x_m REAL NOT NULL", "y_m REAL NOT NULL", "z_m REAL NOT NULL",
        "sigma_m REAL", "covariance_3x3_f64 BLOB", "presence_log_odds REAL NOT NULL"}},
      {"image",
       {"id INTEGER PRIMARY KEY", "keyframe INTEGER NOT NULL", "camera INTEGER NOT NULL",
        "num_observations INTEGER NOT NULL", "landmarks_i32 BLOB NOT NULL", "positions_px_f32 BLOB NOT NULL",
        "descriptors BLOB NOT NULL"}},
      {"loop_edge",
       {"id INTEGER PRIMARY KEY", "first INTEGER NOT NULL", "second INTEGER NOT NULL", "x_m REAL NOT NULL",
        "y_m REAL NOT NULL", "z_m REAL NOT NULL", "qx REAL NOT NULL", "qy REAL NOT NULL", "qz REAL NOT NULL",
        "qw REAL NOT NULL", "num_inliers INTEGER NOT NULL", "accepted INTEGER NOT NULL",
        "reason TEXT NOT NULL"}}};
  return kTables;
}

std::string Table::sql() const {
  std::vector<std::string> definitions(columns.begin(), columns.end());
  definitions.emplace_back("since_version INTEGER NOT NULL");
  return createTable(name, definitions);
}

std::string Table::pastSql() const {
  static const std::string kKey = " PRIMARY KEY";
  std::vector<std::string> definitions(columns.begin(), columns.end());
  definitions[0].erase(definitions[0].size() - kKey.size());  // several versions of a row
  definitions.emplace_back("since_version INTEGER NOT NULL");
  definitions.emplace_back("until_version INTEGER NOT NULL");
  return createTable(std::string("past_") + name, definitions);
}

std::string Table::columnNames(const std::string& prefix) const {
  std::string names;
  for (const char* const definition : columns) {
    names += (names.empty() ? "" : ", ") + prefix + nameOf(definition);
  }
  return names;
}

std::string Table::key() const {
  return nameOf(columns[0]);
}

std::vector<std::pair<std::string, std::string>> tablesOfSchema(uint32_t schema_version) {
  if (schema_version == kOldestSchemaVersion) {
    return tablesOfSchema2();
  }
  std::vector<std::pair<std::string, std::string>> result = {{"version", kVersionSql}};
  for (const Table& table : tables()) {
    result.emplace_back(table.name, table.sql());
    result.emplace_back(std::string("past_") + table.name, table.pastSql());
  }
  return result;
}

std::string attachmentsHash(const std::string& rig_text, const std::vector<std::string>& mask_files,
                            const std::vector<std::vector<uint8_t>>& mask_pngs,
                            const MapProvenance& provenance) {
  ContentHasher hasher;
  hasher.add(rig_text);
  for (const std::string& mask_file : mask_files) {
    hasher.add(mask_file);
  }
  for (const std::vector<uint8_t>& png : mask_pngs) {
    hasher.add(static_cast<int64_t>(png.size()));
    hasher.addBytes(png.data(), png.size());
  }
  for (const auto& [key, value] : provenance) {
    hasher.add(key);
    hasher.add(value);
  }
  return hasher.hex();
}

uint32_t checkHeader(const std::string& path) {
  // Before SQLite opens the file (SQLite's file format, section 1.3).
  if (fs::is_directory(path)) {
    throw InputError(path + ": expected a map file, is a folder");
  }
  if (!fs::exists(path)) {
    throw InputError(path + ": no such file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path + ": cannot be read: " + std::strerror(errno));
  }
  constexpr int kHeaderSize = 100;
  static const char kMagic[16] = {'S', 'Q', 'L', 'i', 't', 'e', ' ', 'f',
                                  'o', 'r', 'm', 'a', 't', ' ', '3', 0};
  char header[kHeaderSize] = {};
  file.read(header, kHeaderSize);
  const auto length = static_cast<size_t>(file.gcount());
  if (length == 0) {
    throw InputError(path + ": expected a map file, is empty");
  }
  if (std::memcmp(header, kMagic, std::min(length, sizeof(kMagic))) != 0) {
    throw InputError(path + ": expected a map file, is no SQLite file");
  }
  if (length < kHeaderSize) {
    throw InputError(path + ": the map is truncated: it ends after " + std::to_string(length) + " bytes");
  }
  if (bigEndian(header + 68, 4) != kApplicationId) {
    throw InputError(path + ": expected a map file, is the SQLite file of another program");
  }
  const uint32_t version = bigEndian(header + 60, 4);
  if (version < kOldestSchemaVersion || version > kSchemaVersion) {
    throw InputError(path + ": the map has version " + std::to_string(version) +
                     " of the file format, this program reads versions " +
                     std::to_string(kOldestSchemaVersion) + " to " + std::to_string(kSchemaVersion) +
                     (version > kSchemaVersion ? ": it was written by a newer program" : ": build it again"));
  }
  const uint64_t page_size = bigEndian(header + 16, 2) == 1 ? 65536 : bigEndian(header + 16, 2);
  const uint64_t expected_size = page_size * bigEndian(header + 28, 4);
  const uint64_t size = fs::file_size(path);
  if (size < expected_size) {
    throw InputError(path + ": the map is truncated: it has " + std::to_string(size) + " of " +
                     std::to_string(expected_size) + " bytes");
  }
  return version;
}

}  // namespace vcharge::map_file
