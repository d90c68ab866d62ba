#include "sparse_map/sparse_map_writer.h"

#include <cmath>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/map_tile.h"

namespace vcharge::map_file {
namespace {

/// Where the rows go, and since which version they are valid.
struct Target {
  SqliteDatabase* database;
  std::string prefix;
  int64_t version;
};

/// Inserts rows into a table; the last parameter is the version.
class Inserter {
 public:
  Inserter(const Target& target, const char* table)
      : statement_(*target.database, sqlOf(target, table).c_str()), version_(target.version) {}

  SqliteStatement* operator->() { return &statement_; }
  /// Inserts a row with as many bound parameters.
  void run(int num_parameters) {
    statement_.bind(num_parameters, version_);
    statement_.run();
  }
  SqliteStatement& statement() { return statement_; }

 private:
  static std::string sqlOf(const Target& target, const std::string& name) {
    for (const Table& table : tables()) {
      if (table.name == name) {
        std::string marks;
        for (size_t i = 0; i <= table.columns.size(); ++i) {
          marks += i == 0 ? "?" : ", ?";
        }
        return "INSERT INTO " + target.prefix + name + " VALUES (" + marks + ")";
      }
    }
    throw std::logic_error("no table " + name);
  }

  SqliteStatement statement_;
  int64_t version_;
};

/// Binds x, y, z, qx, qy, qz, qw to the parameters from `parameter` on.
void bindTransform(const RigidTransform& transform, int parameter, SqliteStatement* statement) {
  for (int i = 0; i < 3; ++i) {
    statement->bind(parameter + i, transform.translation()[i]);
  }
  for (int i = 0; i < 4; ++i) {
    statement->bind(parameter + 3 + i, transform.rotation().coeffs()[i]);
  }
}

/// Row-major; NULL if all entries are zero. `storage` must outlive the statement's next step.
template <int kSize>
void bindCovariance(const Eigen::Matrix<double, kSize, kSize>& covariance, int parameter,
                    Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>* storage,
                    SqliteStatement* statement) {
  *storage = covariance;
  if ((covariance.array() == 0.0).all()) {
    statement->bindNull(parameter);
  } else {
    statement->bindBlob(parameter, storage->data(), sizeof(double) * kSize * kSize);
  }
}

void writeRig(const CameraRig& rig, const MapProvenance& provenance, const Target& target, Inserter* meta) {
  CameraRig without_masks = rig;
  std::vector<std::string> mask_files;
  std::vector<std::vector<uint8_t>> mask_pngs;
  Inserter insert(target, "camera");
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    without_masks.cameras[i].mask.release();
    mask_files.push_back(camera.mask_file);
    mask_pngs.emplace_back();
    if (!camera.mask.empty()) {
      check(cv::imencode(".png", camera.mask, mask_pngs.back()),
            "writeSparseMap: cannot encode a mask as PNG");
    }
    insert->bind(0, static_cast<int64_t>(i));
    insert->bind(1, camera.name);
    insert->bind(2, camera.mask_file);
    insert->bindBlob(3, mask_pngs.back().data(), mask_pngs.back().size());
    insert.run(4);
  }
  const auto put = [&](const char* key, const std::string& text) {
    (*meta)->bind(0, std::string(key));
    (*meta)->bind(1, text);
    meta->run(2);
  };
  const std::string text = formatCameraRig(without_masks);
  put("rig", text);
  put("attachments_hash", attachmentsHash(text, mask_files, mask_pngs, provenance));
}

void writeMeta(const SparseMap& map, const MapProvenance& provenance, const Target& target) {
  const SparseMapContents& contents = map.contents();
  Inserter meta(target, "meta");
  const auto put = [&](const char* key, const auto& value) {
    meta->bind(0, std::string(key));
    meta->bind(1, value);
    meta.run(2);
  };
  put("content_hash", map.contentHash());
  put("descriptor_type", std::string(contents.descriptors.type() == CV_32FC1 ? "float32" : "uint8"));
  put("descriptor_size", static_cast<int64_t>(contents.descriptors.cols));
  put("feature_options", contents.feature_options);
  put("odometry_distance_scale", contents.odometry_distance_scale);
  put("odometry_turn_scale", contents.odometry_turn_scale);
  put("next_keyframe_id", static_cast<int64_t>(contents.next_keyframe_id));
  put("next_landmark_id", static_cast<int64_t>(contents.next_landmark_id));
  writeRig(contents.rig, provenance, target, &meta);

  Inserter insert(target, "provenance");
  for (const auto& [key, value] : provenance) {
    insert->bind(0, key);
    insert->bind(1, value);
    insert.run(2);
  }
}

void writeSessions(const SparseMap& map, const Target& target) {
  Inserter insert(target, "session");
  for (size_t i = 0; i < map.sessions().size(); ++i) {
    insert->bind(0, static_cast<int64_t>(i));
    insert->bind(1, map.sessions()[i].name);
    insert->bind(2, map.sessions()[i].recording_hash);
    insert->bind(3, static_cast<int64_t>(map.sessions()[i].component));
    insert.run(4);
  }
}

void writeKeyframes(const SparseMap& map, const Target& target) {
  Inserter insert(target, "keyframe");
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> covariance;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    insert->bind(0, static_cast<int64_t>(keyframe.id));
    insert->bind(1, static_cast<int64_t>(keyframe.session));
    insert->bind(2, keyframe.stamp.nanoseconds());
    bindTransform(keyframe.map_from_vehicle, 3, &insert.statement());
    bindCovariance<6>(keyframe.covariance, 10, &covariance, &insert.statement());
    insert.run(11);
  }
}

void writeLandmarks(const SparseMap& map, const Target& target) {
  Inserter insert(target, "landmark");
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> covariance;
  for (const MapLandmark& landmark : map.landmarks()) {
    const double variance_m2 = landmark.covariance_m2.trace();
    insert->bind(0, static_cast<int64_t>(landmark.id));
    for (int k = 0; k < 3; ++k) {
      insert->bind(1 + k, landmark.position_m[k]);
    }
    if (variance_m2 > 0.0) {
      insert->bind(4, std::sqrt(variance_m2));
    } else {
      insert->bindNull(4);
    }
    bindCovariance<3>(landmark.covariance_m2, 5, &covariance, &insert.statement());
    insert->bind(6, landmark.presence_log_odds);
    insert.run(7);
  }
}

void writeImages(const SparseMap& map, const Target& target) {
  Inserter insert(target, "image");
  const size_t descriptor_bytes = map.descriptors().cols * map.descriptors().elemSize();
  const size_t num_cameras = map.rig().cameras.size();
  std::vector<int32_t> landmarks;
  std::vector<float> positions_px;
  std::vector<uint8_t> descriptors;
  for (size_t keyframe = 0; keyframe < map.keyframes().size(); ++keyframe) {
    const int64_t keyframe_id = map.keyframes()[keyframe].id;
    for (size_t camera = 0; camera < num_cameras; ++camera) {
      const auto [begin, end] = map.observationsOf(keyframe, camera);
      if (begin == end) {
        continue;
      }
      landmarks.clear();
      positions_px.clear();
      descriptors.clear();
      for (size_t i = begin; i < end; ++i) {
        const MapObservation& observation = map.observations()[i];
        landmarks.push_back(map.landmarks()[static_cast<size_t>(observation.landmark)].id);
        positions_px.push_back(observation.position_px.x());
        positions_px.push_back(observation.position_px.y());
        const uint8_t* descriptor = map.descriptors().ptr(static_cast<int>(i));
        descriptors.insert(descriptors.end(), descriptor, descriptor + descriptor_bytes);
      }
      insert->bind(0, keyframe_id * static_cast<int64_t>(num_cameras) + static_cast<int64_t>(camera));
      insert->bind(1, keyframe_id);
      insert->bind(2, static_cast<int64_t>(camera));
      insert->bind(3, static_cast<int64_t>(end - begin));
      insert->bindBlob(4, landmarks.data(), landmarks.size() * sizeof(int32_t));
      insert->bindBlob(5, positions_px.data(), positions_px.size() * sizeof(float));
      insert->bindBlob(6, descriptors.data(), descriptors.size());
      insert.run(7);
    }
  }
}

void writeLoopEdges(const SparseMap& map, const Target& target) {
  Inserter insert(target, "loop_edge");
  int64_t id = 0;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    const auto idOf = [&](int32_t keyframe) {
      return static_cast<int64_t>(map.keyframes()[static_cast<size_t>(keyframe)].id);
    };
    insert->bind(0, id++);
    insert->bind(1, idOf(edge.first));
    insert->bind(2, idOf(edge.second));
    bindTransform(edge.first_from_second, 3, &insert.statement());
    insert->bind(10, static_cast<int64_t>(edge.num_inliers));
    insert->bind(11, static_cast<int64_t>(edge.accepted));
    insert->bind(12, edge.reason);
    insert.run(13);
  }
}

void createFile(SqliteDatabase* database) {
  database->execute("PRAGMA page_size = " + std::to_string(kPageSize_bytes) +
                    "; PRAGMA application_id = " + std::to_string(kApplicationId) +
                    "; PRAGMA user_version = " + std::to_string(kSchemaVersion) + "; BEGIN");
  for (const auto& [name, sql] : tablesOfSchema(kSchemaVersion)) {
    database->execute(sql);
  }
}

}  // namespace

void writeRows(const SparseMap& map, const MapProvenance& provenance, const std::string& prefix,
               int64_t version, SqliteDatabase* database) {
  const Target target = {database, prefix, version};
  writeMeta(map, provenance, target);
  writeSessions(map, target);
  writeKeyframes(map, target);
  writeLandmarks(map, target);
  writeImages(map, target);
  writeLoopEdges(map, target);
}

void writeIndex(const SparseMap& map, const MapIndex& index, SqliteDatabase* database) {
  for (const char* const name : {"tile", "place", "index_info"}) {
    database->execute(std::string("DROP TABLE IF EXISTS ") + name);
  }
  if (!index.writePlaceRows) {
    return;
  }
  database->execute(kTileSql);
  database->execute(kPlaceSql);
  database->execute(kIndexInfoSql);
  SqliteStatement insert_tile(*database, "INSERT INTO tile VALUES (?, ?, ?)");
  for (const auto& [tile, keyframes] : tilesOf(map.keyframes())) {
    insert_tile.bind(0, static_cast<int64_t>(tile.x));
    insert_tile.bind(1, static_cast<int64_t>(tile.y));
    insert_tile.bind(2, partOf(map, keyframes)->contentHash());
    insert_tile.run();
  }
  SqliteStatement insert_place(*database, "INSERT INTO place VALUES (?, ?)");
  index.writePlaceRows([&](int64_t id, const std::vector<uint8_t>& features) {
    insert_place.bind(0, id);
    insert_place.bindBlob(1, features.data(), features.size());
    insert_place.run();
  });
  SqliteStatement insert_info(*database, "INSERT INTO index_info VALUES (?, ?)");
  const auto put = [&](const std::string& key, const std::string& value) {
    insert_info.bind(0, key);
    insert_info.bind(1, value);
    insert_info.run();
  };
  put(kMapHashKey, map.contentHash());
  put(kOverviewHashKey, SparseMap(overviewOf(map)).contentHash());
  for (const auto& [key, value] : index.info) {
    put(key, value);
  }
}

void writeFirstVersion(const SparseMap& map, const MapProvenance& provenance, const MapIndex& index,
                       SqliteDatabase* database) {
  createFile(database);
  database->execute("INSERT INTO version VALUES (1)");
  writeRows(map, provenance, "", 1, database);
  writeIndex(map, index, database);
  database->execute("COMMIT");
}

}  // namespace vcharge::map_file
