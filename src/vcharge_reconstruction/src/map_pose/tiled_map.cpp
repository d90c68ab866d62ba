#include "vcharge_reconstruction/tiled_map.h"

#include <algorithm>
#include <limits>
#include <list>
#include <mutex>
#include <sstream>
#include <utility>

#include "map_pose/map_places.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/map_tile_reader.h"
#include "vcharge_core/workers/newest_first_worker.h"

namespace vcharge {
namespace {

constexpr const char* kUnrelatedKey = "unrelated_distance";
constexpr const char* kMeanKey = "mean_descriptor";

std::string textOf(const cv::Mat& row) {
  std::ostringstream text;
  text.precision(std::numeric_limits<float>::max_digits10);
  for (int i = 0; i < row.cols; ++i) {
    text << (i == 0 ? "" : " ") << row.at<float>(0, i);
  }
  return text.str();
}

cv::Mat rowOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<float> numbers;
  for (float number = 0.0F; stream >> number;) {
    numbers.push_back(number);
  }
  return numbers.empty() ? cv::Mat() : cv::Mat(numbers, true).reshape(1, 1);
}

/// Descriptors without signatures are those of no extractor; MapLocalizer says so.
bool hasSignatures(const SparseMap& map) {
  return PlaceSignatures::fits(map.descriptors().type(), map.descriptors().cols);
}

struct MapPlaces {
  PlaceSignatures signatures{cv::Mat()};
  std::shared_ptr<const MemoryPlaceTable> table;
};

MapPlaces placesOf(const SparseMap& map) {
  MapPlaces places;
  std::vector<PlaceFeature> features;
  if (hasSignatures(map)) {
    places.signatures = PlaceSignatures::learnedFrom(map.descriptors());
    features = placeFeaturesOf(map, places.signatures);
  }
  places.table = std::make_shared<const MemoryPlaceTable>(std::move(features));
  return places;
}

size_t bytesOfTile(const SparseMap& tile) {
  constexpr size_t kIndex = sizeof(size_t);
  const cv::Mat& descriptors = tile.descriptors();
  return tile.observations().size() * (sizeof(MapObservation) + kIndex) +
         tile.landmarks().size() * (sizeof(MapLandmark) + kIndex) +
         tile.keyframes().size() * sizeof(MapKeyframe) + descriptors.total() * descriptors.elemSize();
}

}  // namespace

/// The tiles of a file that were used last, as far as there is room.
class TiledMap::TileCache {
 public:
  TileCache(std::unique_ptr<MapTileReader> reader, size_t memory_bytes)
      : reader_(std::move(reader)), memory_bytes_(memory_bytes), prefetcher_([this](const MapTile& tile) {
          try {
            at(tile);
          } catch (const InputError&) {  // whoever needs the tile hears of it
          }
        }) {
    size_t number = 0;
    for (const auto& [tile, keyframes] : reader_->tiles()) {
      entries_[tile].number = number++;
      for (size_t i = 0; i < keyframes.size(); ++i) {
        if (places_in_tiles_.size() <= keyframes[i]) {
          places_in_tiles_.resize(keyframes[i] + 1);
        }
        places_in_tiles_[keyframes[i]] = {tile, i};
      }
    }
  }

  const MapTileReader& reader() const { return *reader_; }

  KeyframeInTile tileOf(size_t keyframe) {
    const auto& [tile, index] = places_in_tiles_.at(keyframe);
    return {at(tile), index};
  }

  void prefetch(const MapTile& tile) {
    Entry& entry = entries_.at(tile);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (entry.map == nullptr) {
      prefetcher_.push(entry.number, tile);
    }
  }

 private:
  struct Entry {
    size_t number = 0;
    std::mutex reading;
    std::shared_ptr<const SparseMap> map;  ///< null if it is not in memory
    size_t bytes = 0;
    std::list<MapTile>::iterator use;
  };

  std::shared_ptr<const SparseMap> at(const MapTile& tile) {
    Entry& entry = entries_.at(tile);
    if (auto map = use(&entry)) {
      return map;
    }
    const std::lock_guard<std::mutex> reading(entry.reading);
    if (auto map = use(&entry)) {  // another thread has read it
      return map;
    }
    auto map = reader_->readTile(tile);
    const std::lock_guard<std::mutex> lock(mutex_);
    entry.map = map;
    entry.bytes = bytesOfTile(*map);
    used_bytes_ += entry.bytes;
    entry.use = by_use_.insert(by_use_.begin(), tile);
    while (used_bytes_ > memory_bytes_ && by_use_.size() > 1) {
      Entry& oldest = entries_.at(by_use_.back());
      used_bytes_ -= oldest.bytes;
      oldest.map = nullptr;
      by_use_.pop_back();
    }
    return map;
  }

  std::shared_ptr<const SparseMap> use(Entry* entry) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (entry->map != nullptr) {
      by_use_.splice(by_use_.begin(), by_use_, entry->use);
    }
    return entry->map;
  }

  const std::unique_ptr<MapTileReader> reader_;
  const size_t memory_bytes_;
  std::map<MapTile, Entry> entries_;
  std::vector<std::pair<MapTile, size_t>> places_in_tiles_;  ///< tile and index in it, per keyframe
  std::mutex mutex_;                                         ///< guards what follows and the entries' maps
  std::list<MapTile> by_use_;                                ///< tiles in memory, the last used first
  size_t used_bytes_ = 0;
  NewestFirstWorker<MapTile> prefetcher_;
};

TiledMap::TiledMap(std::shared_ptr<const SparseMap> map) {
  check(map != nullptr, "TiledMap: expected a map");
  useWhole(std::move(map));
}

TiledMap::TiledMap(const std::string& path, size_t memory_bytes) {
  std::unique_ptr<MapTileReader> reader = MapTileReader::open(path);
  if (reader == nullptr) {
    useWhole(readSparseMap(path));
    return;
  }
  const auto infoOf = [&](const char* key) {
    const auto found = reader->info().find(key);
    if (found == reader->info().end()) {
      throw InputError(path + ": the map is damaged: index_info: " + key + " is missing");
    }
    return found->second;
  };
  std::istringstream(infoOf(kUnrelatedKey)) >> unrelated_distance_;
  const cv::Mat mean = rowOf(infoOf(kMeanKey));
  const cv::Mat& layout = reader->overview().descriptors;
  if (!(unrelated_distance_ >= 0.0) || mean.cols != (layout.type() == CV_32FC1 ? layout.cols : 0)) {
    throw InputError(path + ": the map is damaged: index_info does not fit the descriptors");
  }
  tiles_ = reader->tiles();
  cache_ = std::make_unique<TileCache>(std::move(reader), memory_bytes);
  places_ = std::make_unique<PlaceVotes>(std::make_shared<const FilePlaceTable>(cache_->reader()),
                                         PlaceSignatures(mean), static_cast<int>(keyframes().size()),
                                         static_cast<int>(rig().cameras.size()));
}

TiledMap::~TiledMap() = default;

void TiledMap::useWhole(std::shared_ptr<const SparseMap> map) {
  whole_ = std::move(map);
  tiles_ = tilesOf(whole_->keyframes());
  unrelated_distance_ = medianUnrelatedDistance(*whole_);
  const MapPlaces places = placesOf(*whole_);
  places_ =
      std::make_unique<PlaceVotes>(places.table, places.signatures, static_cast<int>(keyframes().size()),
                                   static_cast<int>(rig().cameras.size()));
}

const SparseMapContents& TiledMap::overview() const {
  return whole_ != nullptr ? whole_->contents() : cache_->reader().overview();
}

const CameraRig& TiledMap::rig() const {
  return overview().rig;
}

const std::string& TiledMap::featureOptions() const {
  return overview().feature_options;
}

const std::vector<MapKeyframe>& TiledMap::keyframes() const {
  return overview().keyframes;
}

int TiledMap::descriptorType() const {
  return overview().descriptors.type();
}

int TiledMap::descriptorColumns() const {
  return overview().descriptors.cols;
}

template <class Function>
void TiledMap::forEachTile(const Eigen::Vector3d& position_m, double radius_m, Function&& function) const {
  const Eigen::Vector3d corner_m(radius_m, radius_m, 0.0);
  const MapTile first = tileAt(position_m - corner_m), last = tileAt(position_m + corner_m);
  for (auto tile = tiles_.lower_bound(first); tile != tiles_.end() && !(last < tile->first); ++tile) {
    if (tile->first.y >= first.y && tile->first.y <= last.y) {
      function(tile->first, tile->second);
    }
  }
}

std::vector<size_t> TiledMap::keyframesNear(const Eigen::Vector3d& position_m, double radius_m,
                                            size_t max_keyframes) const {
  std::vector<std::pair<double, size_t>> by_distance;
  forEachTile(position_m, radius_m, [&](const MapTile&, const std::vector<size_t>& keyframes_of_tile) {
    for (const size_t i : keyframes_of_tile) {
      const double distance_m = (keyframes()[i].map_from_vehicle.translation() - position_m).norm();
      if (distance_m <= radius_m) {
        by_distance.emplace_back(distance_m, i);
      }
    }
  });
  std::sort(by_distance.begin(), by_distance.end());
  by_distance.resize(std::min(by_distance.size(), max_keyframes));
  std::vector<size_t> nearest;
  for (const auto& [distance_m, keyframe] : by_distance) {
    nearest.push_back(keyframe);
  }
  return nearest;
}

KeyframeInTile TiledMap::tileOf(size_t keyframe) const {
  return whole_ != nullptr ? KeyframeInTile{whole_, keyframe} : cache_->tileOf(keyframe);
}

void TiledMap::prefetch(const Eigen::Vector3d& position_m, double radius_m) const {
  if (cache_ != nullptr) {
    forEachTile(position_m, radius_m,
                [&](const MapTile& tile, const std::vector<size_t>&) { cache_->prefetch(tile); });
  }
}

const PlaceVotes& TiledMap::places() const {
  return *places_;
}

double TiledMap::unrelatedDistance() const {
  return unrelated_distance_;
}

MapIndex indexForTiles(const SparseMap& map) {
  const MapPlaces places = placesOf(map);
  std::ostringstream unrelated;
  unrelated.precision(std::numeric_limits<double>::max_digits10);
  unrelated << medianUnrelatedDistance(map);
  MapIndex index;
  index.info = {{kUnrelatedKey, unrelated.str()}, {kMeanKey, textOf(places.signatures.mean())}};
  index.writePlaceRows = [table = places.table](const MapIndex::PutRow& put) {
    std::vector<PlaceFeature> features;
    for (int bucket = 0; bucket < PlaceTable::kNumBuckets; ++bucket) {
      table->readBucket(bucket, &features);
      if (!features.empty()) {
        put(bucket, bytesOf(features));
      }
    }
  };
  return index;
}

}  // namespace vcharge
