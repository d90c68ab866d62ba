#include <array>
#include <cmath>
#include <vector>

#include <sqlite3.h>
#include <opencv2/imgcodecs.hpp>

#include "sparse_map/sparse_map_schema.h"
#include "sparse_map/sqlite_database.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace {

using namespace map_file;

void createTables(SqliteDatabase* database) {
  for (const Table& table : tables()) {
    database->execute(table.sql);
  }
}

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

void writeRig(const CameraRig& rig, const MapProvenance& provenance, SqliteDatabase* database,
              SqliteStatement* meta) {
  CameraRig without_masks = rig;
  std::vector<std::string> mask_files;
  std::vector<std::vector<uint8_t>> mask_pngs;
  SqliteStatement insert(*database, "INSERT INTO camera VALUES (?, ?, ?, ?)");
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    without_masks.cameras[i].mask.release();
    mask_files.push_back(camera.mask_file);
    mask_pngs.emplace_back();
    if (!camera.mask.empty()) {
      check(cv::imencode(".png", camera.mask, mask_pngs.back()),
            "writeSparseMap: cannot encode a mask as PNG");
    }
    insert.bind(0, static_cast<int64_t>(i));
    insert.bind(1, camera.name);
    insert.bind(2, camera.mask_file);
    insert.bindBlob(3, mask_pngs.back().data(), mask_pngs.back().size());
    insert.run();
  }
  const std::string text = formatCameraRig(without_masks);
  meta->bind(0, std::string("rig"));
  meta->bind(1, text);
  meta->run();
  meta->bind(0, std::string("attachments_hash"));
  meta->bind(1, attachmentsHash(text, mask_files, mask_pngs, provenance));
  meta->run();
}

void writeMeta(const SparseMap& map, const MapProvenance& provenance, SqliteDatabase* database) {
  const SparseMapContents& contents = map.contents();
  SqliteStatement meta(*database, "INSERT INTO meta VALUES (?, ?)");
  const auto put = [&](const char* key, const auto& value) {
    meta.bind(0, std::string(key));
    meta.bind(1, value);
    meta.run();
  };
  put("content_hash", map.contentHash());
  put("descriptor_type", std::string(contents.descriptors.type() == CV_32FC1 ? "float32" : "uint8"));
  put("descriptor_size", static_cast<int64_t>(contents.descriptors.cols));
  put("feature_options", contents.feature_options);
  put("odometry_distance_scale", contents.odometry_distance_scale);
  put("odometry_turn_scale", contents.odometry_turn_scale);
  writeRig(contents.rig, provenance, database, &meta);

  SqliteStatement insert(*database, "INSERT INTO provenance VALUES (?, ?)");
  for (const auto& [key, value] : provenance) {
    insert.bind(0, key);
    insert.bind(1, value);
    insert.run();
  }
}

void writeKeyframes(const SparseMap& map, SqliteDatabase* database) {
  SqliteStatement insert(*database, "INSERT INTO keyframe VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> covariance;
  for (size_t i = 0; i < map.keyframes().size(); ++i) {
    const MapKeyframe& keyframe = map.keyframes()[i];
    insert.bind(0, static_cast<int64_t>(i));
    insert.bind(1, keyframe.stamp.nanoseconds());
    bindTransform(keyframe.map_from_vehicle, 2, &insert);
    bindCovariance<6>(keyframe.covariance, 9, &covariance, &insert);
    insert.run();
  }
}

void writeLandmarks(const SparseMap& map, SqliteDatabase* database) {
  SqliteStatement insert(*database, "INSERT INTO landmark VALUES (?, ?, ?, ?, ?, ?)");
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> covariance;
  for (size_t i = 0; i < map.landmarks().size(); ++i) {
    const MapLandmark& landmark = map.landmarks()[i];
    const double variance_m2 = landmark.covariance_m2.trace();
    insert.bind(0, static_cast<int64_t>(i));
    for (int k = 0; k < 3; ++k) {
      insert.bind(1 + k, landmark.position_m[k]);
    }
    if (variance_m2 > 0.0) {
      insert.bind(4, std::sqrt(variance_m2));
    } else {
      insert.bindNull(4);
    }
    bindCovariance<3>(landmark.covariance_m2, 5, &covariance, &insert);
    insert.run();
  }
}

void writeLandmarkIndex(const SparseMap& map, SqliteDatabase* database) {
  if (sqlite3_compileoption_used("ENABLE_RTREE") == 0) {
    return;
  }
  database->execute(kLandmarkIndexSql);
  SqliteStatement insert(*database, "INSERT INTO landmark_index VALUES (?, ?, ?, ?, ?, ?, ?)");
  for (size_t i = 0; i < map.landmarks().size(); ++i) {
    insert.bind(0, static_cast<int64_t>(i));
    for (int k = 0; k < 6; ++k) {
      insert.bind(1 + k, map.landmarks()[i].position_m[k / 2]);  // SQLite rounds boxes outwards
    }
    insert.run();
  }
}

void writeImages(const SparseMap& map, SqliteDatabase* database) {
  SqliteStatement insert(*database, "INSERT INTO image VALUES (?, ?, ?, ?, ?, ?, ?)");
  const size_t descriptor_bytes = map.descriptors().cols * map.descriptors().elemSize();
  std::vector<int32_t> landmarks;
  std::vector<float> positions_px;
  std::vector<uint8_t> descriptors;
  int64_t id = 0;
  for (size_t keyframe = 0; keyframe < map.keyframes().size(); ++keyframe) {
    for (size_t camera = 0; camera < map.rig().cameras.size(); ++camera) {
      const auto [begin, end] = map.observationsOf(keyframe, camera);
      if (begin == end) {
        continue;
      }
      landmarks.clear();
      positions_px.clear();
      descriptors.clear();
      for (size_t i = begin; i < end; ++i) {
        const MapObservation& observation = map.observations()[i];
        landmarks.push_back(observation.landmark);
        positions_px.push_back(observation.position_px.x());
        positions_px.push_back(observation.position_px.y());
        const uint8_t* descriptor = map.descriptors().ptr(static_cast<int>(i));
        descriptors.insert(descriptors.end(), descriptor, descriptor + descriptor_bytes);
      }
      insert.bind(0, id++);
      insert.bind(1, static_cast<int64_t>(keyframe));
      insert.bind(2, static_cast<int64_t>(camera));
      insert.bind(3, static_cast<int64_t>(end - begin));
      insert.bindBlob(4, landmarks.data(), landmarks.size() * sizeof(int32_t));
      insert.bindBlob(5, positions_px.data(), positions_px.size() * sizeof(float));
      insert.bindBlob(6, descriptors.data(), descriptors.size());
      insert.run();
    }
  }
}

void writeLoopEdges(const SparseMap& map, SqliteDatabase* database) {
  SqliteStatement insert(*database, "INSERT INTO loop_edge VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  int64_t id = 0;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    insert.bind(0, id++);
    insert.bind(1, static_cast<int64_t>(edge.first));
    insert.bind(2, static_cast<int64_t>(edge.second));
    bindTransform(edge.first_from_second, 3, &insert);
    insert.bind(10, static_cast<int64_t>(edge.num_inliers));
    insert.bind(11, static_cast<int64_t>(edge.accepted));
    insert.bind(12, edge.reason);
    insert.run();
  }
}

}  // namespace

void writeSparseMap(const SparseMap& map, const MapProvenance& provenance, const std::string& path) {
  writeFileAtomically(path, [&](const std::string& temporary) {
    SqliteDatabase database(temporary, path, SqliteDatabase::Access::kCreate);
    database.execute("PRAGMA page_size = " + std::to_string(kPageSize_bytes) +
                     "; PRAGMA application_id = " + std::to_string(kApplicationId) +
                     "; PRAGMA user_version = " + std::to_string(kSchemaVersion) + "; BEGIN");
    createTables(&database);
    writeMeta(map, provenance, &database);
    writeKeyframes(map, &database);
    writeLandmarks(map, &database);
    writeImages(map, &database);
    writeLoopEdges(map, &database);
    writeLandmarkIndex(map, &database);
    database.execute("COMMIT");
  });
}

}  // namespace vcharge
