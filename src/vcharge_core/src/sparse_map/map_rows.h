#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "sparse_map/sparse_map_schema.h"
#include "sparse_map/sqlite_database.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge::map_file {

/// A map file that is open for reading, and the meaning of its rows. Every error is an InputError that names
/// the file.
class MapRows {
 public:
  /// Checks the header and the tables.
  explicit MapRows(const std::string& path);

  const std::string& path() const { return path_; }
  const SqliteDatabase& database() const { return database_; }
  /// Whether the schema has versions, sessions and ids.
  bool hasVersions() const { return schema_ > kOldestSchemaVersion; }
  const std::vector<int64_t>& versions() const { return versions_; }
  /// Selects the version that is read; at first the newest.
  void select(int64_t version);

  /// Whether there is a table exactly as created by `sql`: no view, no generated columns.
  bool hasTable(const std::string& name, const std::string& sql) const;
  /// Columns of a table's rows in the version that is read. `rest`: WHERE and ORDER BY.
  SqliteStatement rows(const std::string& table, const std::string& columns, const std::string& rest) const;
  std::string meta(const char* key) const;
  double metaNumber(const char* key) const;
  MapProvenance readProvenance() const;
  /// What does not grow with the map: rig, sessions, options, scales, next ids.
  void readHead(const MapProvenance& provenance, SparseMapContents* contents) const;

  /// Selects keyframes, for keyframeOf(); landmarks, for landmarkOf(); images, for imageOf() and
  /// copyDescriptors().
  SqliteStatement keyframes(const std::string& rest) const;
  SqliteStatement landmarks(const std::string& rest) const;
  SqliteStatement images(const std::string& rest) const;
  MapKeyframe keyframeOf(const SqliteStatement& row, bool with_covariance) const;
  MapLandmark landmarkOf(const SqliteStatement& row) const;

  /// The observations of an image; `landmark` is an id, `keyframe` is not set.
  struct Image {
    int64_t keyframe_id;
    std::vector<MapObservation> observations;
  };
  Image imageOf(const SqliteStatement& row) const;
  /// Copies an image's descriptors of rows of a size.
  void copyDescriptors(const SqliteStatement& row, size_t num_rows, size_t row_bytes, void* target) const;

  /// Type of OpenCV and number of columns of the descriptors.
  std::pair<int, int> descriptorLayout() const;

  RigidTransform transformOf(const SqliteStatement& row, int column, const std::string& owner) const;
  /// An index, a count or an id; SparseMap checks its range.
  int32_t indexOf(const SqliteStatement& row, int column, const char* table) const;
  /// Index of a record by its id.
  int32_t indexIn(const std::vector<int32_t>& ids, int64_t id, const std::string& owner) const;

  [[noreturn]] void damaged(const std::string& what) const;

 private:
  void checkTables();
  void readRig(const MapProvenance& provenance, CameraRig* rig) const;
  template <class Function>
  void withMeta(const char* key, Function&& function) const;
  template <int kSize>
  Eigen::Matrix<double, kSize, kSize> covarianceOf(const SqliteStatement& row, int column,
                                                   const char* table) const;
  void copyBlob(const SqliteStatement& row, int column, size_t expected_size, const char* table,
                void* target) const;

  const std::string path_;
  const uint32_t schema_;
  SqliteDatabase database_;
  std::vector<int64_t> versions_ = {1};  // without a table of versions there is one
  int64_t version_ = 1;
};

}  // namespace vcharge::map_file
