#include "sparse_map/map_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge::map_file {
namespace {

constexpr int64_t kMaxDescriptorSize = 1 << 16;

}  // namespace

MapRows::MapRows(const std::string& path)
    : path_(path), schema_(checkHeader(path)), database_(path, path, SqliteDatabase::Access::kReadOnly) {
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

bool MapRows::hasTable(const std::string& name, const std::string& sql) const {
  SqliteStatement find(database_, "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?");
  find.bind(0, name);
  return find.step() && find.text(0) == sql;
}

void MapRows::checkTables() {
  for (const auto& [name, sql] : tablesOfSchema(schema_)) {
    if (!hasTable(name, sql)) {
      damaged("the table " + name + " is missing or not as expected");
    }
  }
}

void MapRows::select(int64_t version) {
  if (std::find(versions_.begin(), versions_.end(), version) == versions_.end()) {
    throw InputError(path_ + ": the map has no version " + std::to_string(version) + ", expected " +
                     std::to_string(versions_.front()) + " to " + std::to_string(versions_.back()));
  }
  version_ = version;
}

void MapRows::damaged(const std::string& what) const {
  throw InputError(path_ + ": the map is damaged: " + what);
}

SqliteStatement MapRows::rows(const std::string& table, const std::string& columns,
                              const std::string& rest) const {
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
void MapRows::withMeta(const char* key, Function&& function) const {
  SqliteStatement select = rows("meta", "key, value", "WHERE key = ?");
  select.bind(0, std::string(key));
  if (!select.step()) {
    damaged(std::string("meta: ") + key + " is missing");
  }
  function(select);
}

std::string MapRows::meta(const char* key) const {
  std::string value;
  withMeta(key, [&](const SqliteStatement& row) { value = row.text(1); });
  return value;
}

double MapRows::metaNumber(const char* key) const {
  double value = 0.0;
  withMeta(key, [&](const SqliteStatement& row) { value = row.number(1); });
  return value;
}

MapProvenance MapRows::readProvenance() const {
  MapProvenance provenance;
  SqliteStatement select = rows("provenance", "key, value", "");
  while (select.step()) {
    provenance[select.text(0)] = select.text(1);
  }
  return provenance;
}

void MapRows::readHead(const MapProvenance& provenance, SparseMapContents* contents) const {
  contents->feature_options = meta("feature_options");
  contents->odometry_distance_scale = metaNumber("odometry_distance_scale");
  contents->odometry_turn_scale = metaNumber("odometry_turn_scale");
  readRig(provenance, &contents->rig);
  if (!hasVersions()) {
    return;
  }
  contents->next_keyframe_id = static_cast<int32_t>(metaNumber("next_keyframe_id"));
  contents->next_landmark_id = static_cast<int32_t>(metaNumber("next_landmark_id"));
  contents->sessions.clear();
  SqliteStatement select = rows("session", "id, name, recording_hash, component", "ORDER BY id");
  while (select.step()) {
    contents->sessions.push_back({select.text(1), select.text(2), indexOf(select, 3, "session")});
  }
}

void MapRows::readRig(const MapProvenance& provenance, CameraRig* rig) const {
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

int32_t MapRows::indexIn(const std::vector<int32_t>& ids, int64_t id, const std::string& owner) const {
  const auto found = std::lower_bound(ids.begin(), ids.end(), id);
  if (found == ids.end() || *found != id) {
    damaged(owner + ": there is no such id: " + std::to_string(id));
  }
  return static_cast<int32_t>(found - ids.begin());
}

int32_t MapRows::indexOf(const SqliteStatement& row, int column, const char* table) const {
  const int64_t value = row.integer(column);
  if (value < 0 || value > std::numeric_limits<int32_t>::max()) {
    damaged(std::string(table) + ": " + std::to_string(value) + " is no index");
  }
  return static_cast<int32_t>(value);
}

RigidTransform MapRows::transformOf(const SqliteStatement& row, int column, const std::string& owner) const {
  std::array<double, 7> values{};
  for (int i = 0; i < 7; ++i) {
    values[i] = row.number(column + i);
  }
  const Eigen::Quaterniond rotation(values[6], values[3], values[4], values[5]);
  const Eigen::Vector3d translation_m(values[0], values[1], values[2]);
  if (!(std::abs(rotation.norm() - 1.0) <= 1e-12) || !translation_m.allFinite()) {
    damaged(owner + ": expected a finite translation and a unit quaternion");
  }
  return RigidTransform::fromUnit(rotation, translation_m);
}

template <int kSize>
Eigen::Matrix<double, kSize, kSize> MapRows::covarianceOf(const SqliteStatement& row, int column,
                                                          const char* table) const {
  Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor> matrix;
  if (row.isNull(column)) {
    return Eigen::Matrix<double, kSize, kSize>::Zero();
  }
  copyBlob(row, column, sizeof(double) * kSize * kSize, table, matrix.data());
  return matrix;
}

void MapRows::copyBlob(const SqliteStatement& row, int column, size_t expected_size, const char* table,
                       void* target) const {
  const void* data = row.blob(column);
  if (row.blobSize(column) != expected_size) {
    damaged(std::string(table) + ": a blob has " + std::to_string(row.blobSize(column)) +
            " bytes, expected " + std::to_string(expected_size));
  }
  if (expected_size > 0) {
    std::memcpy(target, data, expected_size);
  }
}

SqliteStatement MapRows::keyframes(const std::string& rest) const {
  return rows("keyframe",
              std::string(hasVersions() ? "id, session" : "id, 0") +
                  ", stamp_ns, x_m, y_m, z_m, qx, qy, qz, qw, covariance_6x6_f64",
              rest);
}

MapKeyframe MapRows::keyframeOf(const SqliteStatement& row, bool with_covariance) const {
  const int32_t id = indexOf(row, 0, "keyframe");
  return {Timestamp::fromNanoseconds(row.integer(2)), transformOf(row, 3, "keyframe " + std::to_string(id)),
          with_covariance ? covarianceOf<6>(row, 10, "keyframe") : Eigen::Matrix<double, 6, 6>::Zero().eval(),
          indexOf(row, 1, "keyframe"), id};
}

SqliteStatement MapRows::landmarks(const std::string& rest) const {
  return rows(
      "landmark",
      std::string("id, x_m, y_m, z_m, covariance_3x3_f64") + (hasVersions() ? ", presence_log_odds" : ", 0"),
      rest);
}

MapLandmark MapRows::landmarkOf(const SqliteStatement& row) const {
  return {Eigen::Vector3d(row.number(1), row.number(2), row.number(3)), covarianceOf<3>(row, 4, "landmark"),
          indexOf(row, 0, "landmark"), row.number(5)};
}

SqliteStatement MapRows::images(const std::string& rest) const {
  return rows("image", "id, keyframe, camera, num_observations, landmarks_i32, positions_px_f32, descriptors",
              rest);
}

MapRows::Image MapRows::imageOf(const SqliteStatement& row) const {
  const int32_t camera = indexOf(row, 2, "image");
  const auto count = static_cast<size_t>(indexOf(row, 3, "image"));
  if (row.blobSize(4) != count * sizeof(int32_t)) {  // before the count is believed
    damaged("image: a blob has " + std::to_string(row.blobSize(4)) + " bytes, expected " +
            std::to_string(count * sizeof(int32_t)));
  }
  std::vector<int32_t> landmarks(count);
  std::vector<float> positions_px(2 * count);
  copyBlob(row, 4, count * sizeof(int32_t), "image", landmarks.data());
  copyBlob(row, 5, 2 * count * sizeof(float), "image", positions_px.data());
  Image image = {row.integer(1), {}};
  image.observations.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    image.observations.push_back({0, camera, landmarks[i], {positions_px[2 * i], positions_px[2 * i + 1]}});
  }
  return image;
}

void MapRows::copyDescriptors(const SqliteStatement& row, size_t num_rows, size_t row_bytes,
                              void* target) const {
  copyBlob(row, 6, num_rows * row_bytes, "image", target);
}

std::pair<int, int> MapRows::descriptorLayout() const {
  const std::string type = meta("descriptor_type");
  int64_t size = 0;
  withMeta("descriptor_size", [&](const SqliteStatement& row) { size = row.integer(1); });
  if ((type != "uint8" && type != "float32") || size < 0 || size > kMaxDescriptorSize) {
    damaged("meta: descriptor_type or descriptor_size");
  }
  return {type == "uint8" ? CV_8UC1 : CV_32FC1, static_cast<int>(size)};
}

}  // namespace vcharge::map_file
