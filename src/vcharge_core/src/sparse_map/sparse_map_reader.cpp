#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "sparse_map/sparse_map_schema.h"
#include "sparse_map/sqlite_database.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

using namespace map_file;

constexpr int64_t kMaxDescriptorSize = 1 << 16;

/// Reads one file. Throws InputError and std::invalid_argument, to which the caller adds the file name.
class Reader {
 public:
  explicit Reader(const std::string& path)
      : path_(path),
        schema_(checkHeader(path)),
        file_size_(fs::file_size(path)),
        database_(path, path, SqliteDatabase::Access::kReadOnly) {
    checkIntegrity();
    checkTables();
    if (hasVersions()) {
      versions_.clear();
      SqliteStatement select(database_, "SELECT number FROM version ORDER BY number");
      while (select.step()) {
        versions_.push_back(select.integer(0));
      }
      if (versions_.empty()) {
        damaged("it holds no version");
      }
    }
    version_ = versions_.back();
  }

  const std::vector<int64_t>& versions() const { return versions_; }

  /// Selects the version that is read.
  void select(int64_t version) {
    if (std::find(versions_.begin(), versions_.end(), version) == versions_.end()) {
      throw InputError(path_ + ": the map has no version " + std::to_string(version) + ", expected " +
                       std::to_string(versions_.front()) + " to " + std::to_string(versions_.back()));
    }
    version_ = version;
  }

  SparseMapContents read(MapProvenance* provenance) {
    SparseMapContents contents;
    contents.feature_options = meta("feature_options");
    contents.odometry_distance_scale = metaNumber("odometry_distance_scale");
    contents.odometry_turn_scale = metaNumber("odometry_turn_scale");
    const MapProvenance read_provenance = readProvenance();
    readRig(read_provenance, &contents.rig);
    readSessions(&contents);
    readKeyframes(&contents.keyframes);
    readLandmarks(&contents.landmarks);
    if (!hasVersions()) {  // ids count from 0
      contents.next_keyframe_id = static_cast<int32_t>(contents.keyframes.size());
      contents.next_landmark_id = static_cast<int32_t>(contents.landmarks.size());
    }
    readImages(&contents);
    readLoopEdges(&contents.loop_edges);
    if (provenance != nullptr) {
      *provenance = read_provenance;
    }
    return contents;
  }

  /// Whether the map's content is what was written. Files of the oldest schema hold a hash without sessions.
  bool hasHash(const SparseMap& map) {
    return meta("content_hash") == (hasVersions() ? map.contentHash() : map.contentHashWithoutSessions());
  }

  std::string meta(const char* key) {
    std::string value;
    withMeta(key, [&](const SqliteStatement& row) { value = row.text(1); });
    return value;
  }

  MapProvenance readProvenance() {
    MapProvenance provenance;
    SqliteStatement select = rows("provenance", "key, value", "");
    while (select.step()) {
      provenance[select.text(0)] = select.text(1);
    }
    return provenance;
  }

  [[noreturn]] void damaged(const std::string& what) const {
    throw InputError(path_ + ": the map is damaged: " + what);
  }

 private:
  /// SQLite's own check covers what no hash covers, and locates the damage.
  void checkIntegrity() {
    SqliteStatement check(database_, "PRAGMA integrity_check(1)");
    if (!check.step() || check.text(0) != "ok") {
      damaged(check.text(0));
    }
  }

  bool hasVersions() const { return schema_ > kOldestSchemaVersion; }

  /// Accepts only tables exactly as they were created: no views, no generated columns.
  void checkTables() {
    for (const auto& [name, sql] : tablesOfSchema(schema_)) {
      SqliteStatement find(database_, "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?");
      find.bind(0, name);
      if (!find.step() || find.text(0) != sql) {
        damaged("the table " + name + " is missing or not as expected");
      }
    }
  }

  /// Selects columns of a table's rows in the version that is read. `rest`: WHERE and ORDER BY.
  SqliteStatement rows(const std::string& table, const std::string& columns, const std::string& rest) const {
    std::string from = table;
    if (version_ != versions_.back()) {
      const std::string version = std::to_string(version_);
      from = "(SELECT " + columns + " FROM " + table + " WHERE since_version <= " + version +
             " UNION ALL SELECT " + columns + " FROM past_" + table + " WHERE since_version <= " + version +
             " AND until_version >= " + version + ")";
    }
    return SqliteStatement(database_, ("SELECT " + columns + " FROM " + from + " " + rest).c_str());
  }

  template <class Function>
  void withMeta(const char* key, Function&& function) {
    SqliteStatement select = rows("meta", "key, value", "WHERE key = ?");
    select.bind(0, std::string(key));
    if (!select.step()) {
      damaged(std::string("meta: ") + key + " is missing");
    }
    function(select);
  }

  double metaNumber(const char* key) {
    double value = 0.0;
    withMeta(key, [&](const SqliteStatement& row) { value = row.number(1); });
    return value;
  }

  void readRig(const MapProvenance& provenance, CameraRig* rig) {
    const std::string text = meta("rig");
    std::vector<std::string> names, mask_files;
    std::vector<std::vector<uint8_t>> mask_pngs;
    SqliteStatement select = rows("camera", "id, name, mask_file, mask_png", "ORDER BY id");
    while (select.step()) {
      names.push_back(select.text(1));
      mask_files.push_back(select.text(2));
      const auto* png = static_cast<const uint8_t*>(select.blob(3));
      mask_pngs.emplace_back(png, png + select.blobSize(3));
    }
    if (attachmentsHash(text, mask_files, mask_pngs, provenance) != meta("attachments_hash")) {
      damaged("rig, masks or provenance differ from what was written");
    }
    *rig = parseCameraRig(text, path_ + ": rig", "");
    if (rig->cameras.size() != names.size()) {
      damaged("rig and table camera have different cameras");
    }
    for (size_t i = 0; i < names.size(); ++i) {
      RigCamera& camera = rig->cameras[i];
      camera.mask_file = mask_files[i];
      if (!mask_pngs[i].empty()) {
        camera.mask = cv::imdecode(mask_pngs[i], cv::IMREAD_GRAYSCALE);
      }
      if (camera.name != names[i] || (!mask_pngs[i].empty() && camera.mask.size() != camera.image_size_px)) {
        damaged("camera " + std::to_string(i) + ": name or mask differ from the rig");
      }
    }
  }

  /// Index of a record by its id.
  int32_t indexOf(const std::vector<int32_t>& ids, int64_t id, const std::string& owner) const {
    const auto found = std::lower_bound(ids.begin(), ids.end(), id);
    if (found == ids.end() || *found != id) {
      damaged(owner + ": there is no such id: " + std::to_string(id));
    }
    return static_cast<int32_t>(found - ids.begin());
  }

  /// Reads an index or count; SparseMap checks its range.
  int32_t index(const SqliteStatement& select, int column, const char* table) const {
    const int64_t value = select.integer(column);
    if (value < 0 || value > std::numeric_limits<int32_t>::max()) {
      damaged(std::string(table) + ": " + std::to_string(value) + " is no index");
    }
    return static_cast<int32_t>(value);
  }

  RigidTransform transform(const SqliteStatement& select, int column, const std::string& owner) const {
    std::array<double, 7> values{};
    for (int i = 0; i < 7; ++i) {
      values[i] = select.number(column + i);
    }
    const Eigen::Quaterniond rotation(values[6], values[3], values[4], values[5]);
    const Eigen::Vector3d translation_m(values[0], values[1], values[2]);
    if (!(std::abs(rotation.norm() - 1.0) <= 1e-12) || !translation_m.allFinite()) {
      damaged(owner + ": expected a finite translation and a unit quaternion");
    }
    return RigidTransform::fromUnit(rotation, translation_m);
  }

  template <int kSize>
  Eigen::Matrix<double, kSize, kSize> covariance(const SqliteStatement& select, int column,
                                                 const char* table) const {
    Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor> matrix;
    if (select.isNull(column)) {
      return Eigen::Matrix<double, kSize, kSize>::Zero();
    }
    copyBlob(select, column, sizeof(double) * kSize * kSize, table, matrix.data());
    return matrix;
  }

  void copyBlob(const SqliteStatement& select, int column, size_t expected_size, const char* table,
                void* target) const {
    const void* data = select.blob(column);
    if (select.blobSize(column) != expected_size) {
      damaged(std::string(table) + ": a blob has " + std::to_string(select.blobSize(column)) +
              " bytes, expected " + std::to_string(expected_size));
    }
    if (expected_size > 0) {
      std::memcpy(target, data, expected_size);
    }
  }

  void readSessions(SparseMapContents* contents) {
    if (!hasVersions()) {
      return;
    }
    contents->next_keyframe_id = static_cast<int32_t>(metaNumber("next_keyframe_id"));
    contents->next_landmark_id = static_cast<int32_t>(metaNumber("next_landmark_id"));
    contents->sessions.clear();
    SqliteStatement select = rows("session", "id, name, recording_hash, component", "ORDER BY id");
    while (select.step()) {
      contents->sessions.push_back({select.text(1), select.text(2), index(select, 3, "session")});
    }
  }

  void readKeyframes(std::vector<MapKeyframe>* keyframes) {
    const std::string poses = ", stamp_ns, x_m, y_m, z_m, qx, qy, qz, qw, covariance_6x6_f64";
    SqliteStatement select =
        rows("keyframe", (hasVersions() ? "id, session" : "id, 0") + poses, "ORDER BY id");
    while (select.step()) {
      const int32_t id = index(select, 0, "keyframe");
      keyframes->push_back({Timestamp::fromNanoseconds(select.integer(2)),
                            transform(select, 3, "keyframe " + std::to_string(id)),
                            covariance<6>(select, 10, "keyframe"), index(select, 1, "keyframe"), id});
      keyframe_ids_.push_back(id);
    }
  }

  void readLandmarks(std::vector<MapLandmark>* landmarks) {
    SqliteStatement select = rows("landmark",
                                  std::string("id, x_m, y_m, z_m, covariance_3x3_f64") +
                                      (hasVersions() ? ", presence_log_odds" : ", 0"),
                                  "ORDER BY id");
    while (select.step()) {
      const int32_t id = index(select, 0, "landmark");
      landmarks->push_back({Eigen::Vector3d(select.number(1), select.number(2), select.number(3)),
                            covariance<3>(select, 4, "landmark"), id, select.number(5)});
      landmark_ids_.push_back(id);
    }
  }

  /// Checks the size of the descriptors before allocating them.
  cv::Mat allocateDescriptors() {
    const std::string type = meta("descriptor_type");
    int64_t size = 0;
    withMeta("descriptor_size", [&](const SqliteStatement& row) { size = row.integer(1); });
    if ((type != "uint8" && type != "float32") || size < 0 || size > kMaxDescriptorSize) {
      damaged("meta: descriptor_type or descriptor_size");
    }
    uint64_t num_rows = 0;
    SqliteStatement select = rows("image", "num_observations", "");
    while (select.step()) {
      num_rows += static_cast<uint64_t>(index(select, 0, "image"));
    }
    // An observation needs at least an index and a position.
    constexpr uint64_t kMinObservationSize = sizeof(int32_t) + 2 * sizeof(float);
    const uint64_t element_size = type == "uint8" ? 1 : sizeof(float);
    if (num_rows > file_size_ / (kMinObservationSize + static_cast<uint64_t>(size) * element_size) ||
        num_rows > static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) {
      damaged("image: more observations than the file holds");
    }
    return cv::Mat(static_cast<int>(num_rows), static_cast<int>(size), type == "uint8" ? CV_8UC1 : CV_32FC1);
  }

  void readImages(SparseMapContents* contents) {
    cv::Mat& descriptors = contents->descriptors;
    descriptors = allocateDescriptors();
    contents->observations.resize(static_cast<size_t>(descriptors.rows));
    const size_t descriptor_bytes = descriptors.cols * descriptors.elemSize();
    std::vector<int32_t> landmarks;
    std::vector<float> positions_px;
    size_t next = 0;
    SqliteStatement select =
        rows("image", "id, keyframe, camera, num_observations, landmarks_i32, positions_px_f32, descriptors",
             "ORDER BY id");
    while (select.step()) {
      const int32_t keyframe = indexOf(keyframe_ids_, select.integer(1), "image: keyframe");
      const int32_t camera = index(select, 2, "image");
      const auto count = static_cast<size_t>(index(select, 3, "image"));
      if (count > contents->observations.size() - next) {
        damaged("image: more observations than counted");
      }
      landmarks.resize(count);
      positions_px.resize(2 * count);
      copyBlob(select, 4, count * sizeof(int32_t), "image", landmarks.data());
      copyBlob(select, 5, 2 * count * sizeof(float), "image", positions_px.data());
      copyBlob(select, 6, count * descriptor_bytes, "image",
               count == 0 ? nullptr : descriptors.ptr(static_cast<int>(next)));
      for (size_t i = 0; i < count; ++i) {
        contents->observations[next++] = {keyframe,
                                          camera,
                                          indexOf(landmark_ids_, landmarks[i], "image: landmark"),
                                          {positions_px[2 * i], positions_px[2 * i + 1]}};
      }
    }
    if (next != contents->observations.size()) {
      damaged("image: fewer observations than counted");
    }
  }

  void readLoopEdges(std::vector<MapLoopEdge>* edges) {
    SqliteStatement select =
        rows("loop_edge", "id, first, second, x_m, y_m, z_m, qx, qy, qz, qw, num_inliers, accepted, reason",
             "ORDER BY id");
    while (select.step()) {
      const std::string owner = "loop_edge " + std::to_string(select.integer(0));
      edges->push_back({indexOf(keyframe_ids_, select.integer(1), owner + ": first"),
                        indexOf(keyframe_ids_, select.integer(2), owner + ": second"),
                        transform(select, 3, owner), index(select, 10, "loop_edge"), select.integer(11) != 0,
                        select.text(12)});
    }
  }

  const std::string path_;
  const uint32_t schema_;
  const uint64_t file_size_;
  SqliteDatabase database_;
  std::vector<int64_t> versions_ = {1};  // without a table of versions there is one
  int64_t version_ = 1;
  std::vector<int32_t> keyframe_ids_, landmark_ids_;
};

}  // namespace

std::shared_ptr<const SparseMap> readSparseMap(const std::string& path, MapProvenance* provenance,
                                               std::optional<int64_t> version) {
  Reader reader(path);
  if (version) {
    reader.select(*version);
  }
  try {
    MapProvenance read_provenance;
    auto map = std::make_shared<const SparseMap>(reader.read(&read_provenance));
    if (!reader.hasHash(*map)) {
      reader.damaged("its content does not match the written hash");
    }
    if (provenance != nullptr) {
      *provenance = std::move(read_provenance);
    }
    return map;
  } catch (const std::logic_error& error) {  // from SparseMap and its parts about their arguments
    reader.damaged(error.what());
  } catch (const cv::Exception& error) {
    reader.damaged(error.what());
  }
}

std::vector<MapVersion> readMapVersions(const std::string& path) {
  Reader reader(path);
  std::vector<MapVersion> versions;
  for (const int64_t number : reader.versions()) {
    reader.select(number);
    versions.push_back({number, reader.meta("content_hash"), reader.readProvenance()});
  }
  return versions;
}

}  // namespace vcharge
