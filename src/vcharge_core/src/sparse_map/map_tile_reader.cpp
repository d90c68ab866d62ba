#include "vcharge_core/sparse_map/map_tile_reader.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "sparse_map/map_rows.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using namespace map_file;

/// Whether the file has the tables of an index, of its newest version.
bool hasIndex(const MapRows& file) {
  if (!file.hasTable("tile", kTileSql) || !file.hasTable("place", kPlaceSql) ||
      !file.hasTable("index_info", kIndexInfoSql)) {
    return false;
  }
  SqliteStatement find(file.database(), "SELECT value FROM index_info WHERE key = ?");
  find.bind(0, std::string(kMapHashKey));
  return find.step() && find.text(0) == file.meta("content_hash");
}

}  // namespace

struct MapTileReader::Connection {
  explicit Connection(const std::string& path) : file(path) {}

  MapRows file;
  std::unique_ptr<SqliteStatement> place;  ///< features of a place's row
  std::pair<int, int> descriptors;         ///< type and columns
  std::map<MapTile, std::string> hash_of_tile;
};

std::unique_ptr<MapTileReader> MapTileReader::open(const std::string& path) {
  auto connection = std::make_unique<Connection>(path);
  if (!hasIndex(connection->file)) {
    return nullptr;
  }
  try {
    return std::unique_ptr<MapTileReader>(new MapTileReader(std::move(connection)));
  } catch (const std::logic_error& error) {  // from the parts about their arguments
    throw InputError(path + ": the map is damaged: " + error.what());
  } catch (const cv::Exception& error) {
    throw InputError(path + ": the map is damaged: " + error.what());
  }
}

MapTileReader::MapTileReader(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {
  const MapRows& file = connection_->file;
  SparseMapContents overview;
  file.readHead(file.readProvenance(), &overview);
  SqliteStatement count(file.database(), "SELECT COUNT(*) FROM keyframe");
  overview.keyframes.reserve(count.step() ? static_cast<size_t>(count.integer(0)) : 0);
  SqliteStatement keyframes = file.keyframes("ORDER BY id");
  while (keyframes.step()) {
    overview.keyframes.push_back(file.keyframeOf(keyframes, false));
  }
  tiles_ = tilesOf(overview.keyframes);
  connection_->descriptors = file.descriptorLayout();
  connection_->place =
      std::make_unique<SqliteStatement>(file.database(), "SELECT features FROM place WHERE id = ?");
  SqliteStatement hashes(file.database(), "SELECT x, y, content_hash FROM tile");
  while (hashes.step()) {
    connection_
        ->hash_of_tile[{static_cast<int32_t>(hashes.integer(0)), static_cast<int32_t>(hashes.integer(1))}] =
        hashes.text(2);
  }
  SqliteStatement info(file.database(), "SELECT key, value FROM index_info");
  while (info.step()) {
    info_[info.text(0)] = info.text(1);
  }
  overview.descriptors.create(0, connection_->descriptors.second, connection_->descriptors.first);
  overview_ = std::make_unique<SparseMap>(std::move(overview));  // a copy of many keyframes takes time
  if (overview_->contentHash() != info_[kOverviewHashKey]) {
    file.damaged("its overview does not match the written hash");
  }
}

MapTileReader::~MapTileReader() = default;

std::shared_ptr<const SparseMap> MapTileReader::readTile(const MapTile& tile) const {
  const std::vector<size_t>& keyframes = tiles_.at(tile);
  const std::lock_guard<std::mutex> lock(mutex_);
  const MapRows& file = connection_->file;
  const std::string name =
      "the tile at " + std::to_string(tile.x * kTileSize_m) + ", " + std::to_string(tile.y * kTileSize_m);
  try {
    SparseMapContents part = headOf(overview_->contents());
    const auto [type, columns] = connection_->descriptors;
    const size_t row_bytes = static_cast<size_t>(columns) * static_cast<size_t>(CV_ELEM_SIZE(type));
    std::vector<uint8_t> descriptors;
    SqliteStatement images = file.images("WHERE keyframe = ? AND id >= ? AND id < ? ORDER BY id");
    const auto num_cameras = static_cast<int64_t>(overview_->rig().cameras.size());
    for (const size_t keyframe : keyframes) {
      const auto index = static_cast<int32_t>(part.keyframes.size());
      part.keyframes.push_back(overview_->keyframes()[keyframe]);
      const int64_t id = overview_->keyframes()[keyframe].id;
      images.bind(0, id);
      images.bind(1, id * num_cameras);  // the key of an image
      images.bind(2, (id + 1) * num_cameras);
      while (images.step()) {
        MapRows::Image image = file.imageOf(images);
        const size_t count = image.observations.size();
        descriptors.resize(descriptors.size() + count * row_bytes);
        file.copyDescriptors(images, count, row_bytes,
                             descriptors.data() + descriptors.size() - count * row_bytes);
        for (MapObservation& observation : image.observations) {
          observation.keyframe = index;
          part.observations.push_back(observation);
        }
      }
      images.reset();
    }
    std::vector<int32_t> ids;
    for (const MapObservation& observation : part.observations) {
      ids.push_back(observation.landmark);
    }
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    SqliteStatement landmarks = file.landmarks("WHERE id = ?");
    for (const int32_t id : ids) {
      landmarks.bind(0, int64_t{id});
      if (!landmarks.step()) {
        file.damaged(name + ": there is no landmark " + std::to_string(id));
      }
      part.landmarks.push_back(file.landmarkOf(landmarks));
      landmarks.reset();
    }
    for (MapObservation& observation : part.observations) {
      observation.landmark = file.indexIn(ids, observation.landmark, name);
    }
    part.descriptors =
        cv::Mat(static_cast<int>(part.observations.size()), columns, type, descriptors.data()).clone();
    auto map = std::make_shared<const SparseMap>(std::move(part));
    const auto hash = connection_->hash_of_tile.find(tile);
    if (hash == connection_->hash_of_tile.end() || hash->second != map->contentHash()) {
      file.damaged(name + ": its content does not match the written hash");
    }
    return map;
  } catch (const std::logic_error& error) {
    file.damaged(name + ": " + error.what());
  }
}

std::vector<uint8_t> MapTileReader::readPlaceRow(int64_t id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  SqliteStatement& find = *connection_->place;
  find.bind(0, id);
  std::vector<uint8_t> row;
  if (find.step()) {
    const auto* bytes = static_cast<const uint8_t*>(find.blob(0));
    row.assign(bytes, bytes + find.blobSize(0));
  }
  find.reset();
  return row;
}

}  // namespace vcharge
