#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>

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

uint32_t bigEndian(const char* bytes, int count) {
  uint32_t value = 0;
  for (int i = 0; i < count; ++i) {
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

/// Checks the header before SQLite opens the file (SQLite's file format, section 1.3).
void checkHeader(const std::string& path) {
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
  if (version != kSchemaVersion) {
    throw InputError(path + ": the map has version " + std::to_string(version) +
                     " of the file format, this program reads version " + std::to_string(kSchemaVersion) +
                     (version > kSchemaVersion ? ": it was written by a newer program" : ": build it again"));
  }
  const uint64_t page_size = bigEndian(header + 16, 2) == 1 ? 65536 : bigEndian(header + 16, 2);
  const uint64_t expected_size = page_size * bigEndian(header + 28, 4);
  const uint64_t size = fs::file_size(path);
  if (size < expected_size) {
    throw InputError(path + ": the map is truncated: it has " + std::to_string(size) + " of " +
                     std::to_string(expected_size) + " bytes");
  }
}

/// Reads one file. Throws InputError and std::invalid_argument, to which the caller adds the file name.
class Reader {
 public:
  explicit Reader(const std::string& path)
      : path_(path),
        file_size_(fs::file_size(path)),
        database_(path, path, SqliteDatabase::Access::kReadOnly) {
    checkIntegrity();
    checkTables();
  }

  SparseMapContents read(MapProvenance* provenance) {
    SparseMapContents contents;
    contents.feature_options = meta("feature_options");
    contents.odometry_distance_scale = metaNumber("odometry_distance_scale");
    contents.odometry_turn_scale = metaNumber("odometry_turn_scale");
    const MapProvenance read_provenance = readProvenance();
    readRig(read_provenance, &contents.rig);
    readKeyframes(&contents.keyframes);
    readLandmarks(&contents.landmarks);
    readImages(&contents);
    readLoopEdges(&contents.loop_edges);
    if (provenance != nullptr) {
      *provenance = read_provenance;
    }
    return contents;
  }

  std::string meta(const char* key) {
    std::string value;
    withMeta(key, [&](const SqliteStatement& row) { value = row.text(0); });
    return value;
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

  /// Accepts only tables exactly as they were created: no views, no generated columns.
  void checkTables() {
    for (const Table& table : tables()) {
      SqliteStatement find(database_, "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?");
      find.bind(0, std::string(table.name));
      if (!find.step() || find.text(0) != table.sql) {
        damaged(std::string("the table ") + table.name + " is missing or not as expected");
      }
    }
  }

  template <class Function>
  void withMeta(const char* key, Function&& function) {
    SqliteStatement select(database_, "SELECT value FROM meta WHERE key = ?");
    select.bind(0, std::string(key));
    if (!select.step()) {
      damaged(std::string("meta: ") + key + " is missing");
    }
    function(select);
  }

  double metaNumber(const char* key) {
    double value = 0.0;
    withMeta(key, [&](const SqliteStatement& row) { value = row.number(0); });
    return value;
  }

  MapProvenance readProvenance() {
    MapProvenance provenance;
    SqliteStatement select(database_, "SELECT key, value FROM provenance");
    while (select.step()) {
      provenance[select.text(0)] = select.text(1);
    }
    return provenance;
  }

  void readRig(const MapProvenance& provenance, CameraRig* rig) {
    const std::string text = meta("rig");
    std::vector<std::string> names, mask_files;
    std::vector<std::vector<uint8_t>> mask_pngs;
    SqliteStatement select(database_, "SELECT name, mask_file, mask_png FROM camera ORDER BY id");
    while (select.step()) {
      names.push_back(select.text(0));
      mask_files.push_back(select.text(1));
      const auto* png = static_cast<const uint8_t*>(select.blob(2));
      mask_pngs.emplace_back(png, png + select.blobSize(2));
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

  void checkId(const SqliteStatement& select, const char* table, size_t expected) const {
    if (select.integer(0) != static_cast<int64_t>(expected)) {
      damaged(std::string(table) + " " + std::to_string(expected) + " is missing");
    }
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

  void readKeyframes(std::vector<MapKeyframe>* keyframes) {
    SqliteStatement select(database_,
                           "SELECT id, stamp_ns, x_m, y_m, z_m, qx, qy, qz, qw, covariance_6x6_f64"
                           " FROM keyframe ORDER BY id");
    while (select.step()) {
      checkId(select, "keyframe", keyframes->size());
      keyframes->push_back({Timestamp::fromNanoseconds(select.integer(1)),
                            transform(select, 2, "keyframe " + std::to_string(keyframes->size())),
                            covariance<6>(select, 9, "keyframe")});
    }
  }

  void readLandmarks(std::vector<MapLandmark>* landmarks) {
    SqliteStatement select(database_,
                           "SELECT id, x_m, y_m, z_m, covariance_3x3_f64 FROM landmark ORDER BY id");
    while (select.step()) {
      checkId(select, "landmark", landmarks->size());
      landmarks->push_back({Eigen::Vector3d(select.number(1), select.number(2), select.number(3)),
                            covariance<3>(select, 4, "landmark")});
    }
  }

  /// Checks the size of the descriptors before allocating them.
  cv::Mat allocateDescriptors() {
    const std::string type = meta("descriptor_type");
    int64_t size = 0;
    withMeta("descriptor_size", [&](const SqliteStatement& row) { size = row.integer(0); });
    if ((type != "uint8" && type != "float32") || size < 0 || size > kMaxDescriptorSize) {
      damaged("meta: descriptor_type or descriptor_size");
    }
    uint64_t num_rows = 0;
    SqliteStatement select(database_, "SELECT num_observations FROM image");
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
    SqliteStatement select(database_,
                           "SELECT keyframe, camera, num_observations, landmarks_i32, positions_px_f32,"
                           " descriptors FROM image ORDER BY id");
    while (select.step()) {
      const int32_t keyframe = index(select, 0, "image");
      const int32_t camera = index(select, 1, "image");
      const auto count = static_cast<size_t>(index(select, 2, "image"));
      if (count > contents->observations.size() - next) {
        damaged("image: more observations than counted");
      }
      landmarks.resize(count);
      positions_px.resize(2 * count);
      copyBlob(select, 3, count * sizeof(int32_t), "image", landmarks.data());
      copyBlob(select, 4, 2 * count * sizeof(float), "image", positions_px.data());
      copyBlob(select, 5, count * descriptor_bytes, "image",
               count == 0 ? nullptr : descriptors.ptr(static_cast<int>(next)));
      for (size_t i = 0; i < count; ++i) {
        contents->observations[next++] = {
            keyframe, camera, landmarks[i], {positions_px[2 * i], positions_px[2 * i + 1]}};
      }
    }
    if (next != contents->observations.size()) {
      damaged("image: fewer observations than counted");
    }
  }

  void readLoopEdges(std::vector<MapLoopEdge>* edges) {
    SqliteStatement select(database_,
                           "SELECT id, first, second, x_m, y_m, z_m, qx, qy, qz, qw, num_inliers, accepted,"
                           " reason FROM loop_edge ORDER BY id");
    while (select.step()) {
      checkId(select, "loop_edge", edges->size());
      edges->push_back({index(select, 1, "loop_edge"), index(select, 2, "loop_edge"),
                        transform(select, 3, "loop_edge " + std::to_string(edges->size())),
                        index(select, 10, "loop_edge"), select.integer(11) != 0, select.text(12)});
    }
  }

  const std::string path_;
  const uint64_t file_size_;
  SqliteDatabase database_;
};

}  // namespace

std::shared_ptr<const SparseMap> readSparseMap(const std::string& path, MapProvenance* provenance) {
  checkHeader(path);
  Reader reader(path);
  try {
    MapProvenance read_provenance;
    auto map = std::make_shared<const SparseMap>(reader.read(&read_provenance));
    if (map->contentHash() != reader.meta("content_hash")) {
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

}  // namespace vcharge
