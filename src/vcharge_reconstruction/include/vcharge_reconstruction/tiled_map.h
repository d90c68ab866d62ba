#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/sparse_map/map_tile.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_features/place_votes.h"

namespace vcharge {

/// A keyframe of a map and the part of the map that holds its images.
struct KeyframeInTile {
  std::shared_ptr<const SparseMap> tile;
  size_t index = 0;  ///< of the keyframe in the tile
};

/// A map to localize in: one in memory, or a file whose tiles are read when they are needed and stay in
/// memory while there is room. Both give the same poses. Immutable, and safe to use from several threads.
class TiledMap {
 public:
  static constexpr size_t kDefaultMemory_bytes = size_t{192} << 20;

  /// std::logic_error without a map.
  explicit TiledMap(std::shared_ptr<const SparseMap> map);
  /// Opens a file; one without tiles is read as a whole. `memory_bytes`: room for tiles. InputError naming
  /// the file and the reason.
  explicit TiledMap(const std::string& path, size_t memory_bytes = kDefaultMemory_bytes);
  ~TiledMap();

  const CameraRig& rig() const;
  const std::string& featureOptions() const;
  /// All keyframes; their covariances may be left out.
  const std::vector<MapKeyframe>& keyframes() const;
  /// Type and columns of the descriptors, as cv::Mat has them.
  int descriptorType() const;
  int descriptorColumns() const;

  /// The nearest keyframes within a radius, nearest first.
  std::vector<size_t> keyframesNear(const Eigen::Vector3d& position_m, double radius_m,
                                    size_t max_keyframes) const;
  /// Reads the keyframe's tile if it is not in memory. InputError naming the file for a damaged tile.
  KeyframeInTile tileOf(size_t keyframe) const;
  /// Reads the tiles within a radius, if they are not in memory, on another thread.
  void prefetch(const Eigen::Vector3d& position_m, double radius_m) const;

  /// Places are keyframes.
  const PlaceVotes& places() const;
  /// Median distance of the descriptors of different landmarks; 0 if there are none.
  double unrelatedDistance() const;

 private:
  class TileCache;
  void useWhole(std::shared_ptr<const SparseMap> map);
  const SparseMapContents& overview() const;
  template <class Function>
  void forEachTile(const Eigen::Vector3d& position_m, double radius_m, Function&& function) const;

  std::shared_ptr<const SparseMap> whole_;  ///< null if tiles are read
  std::unique_ptr<TileCache> cache_;
  std::map<MapTile, std::vector<size_t>> tiles_;
  std::unique_ptr<PlaceVotes> places_;
  double unrelated_distance_ = 0.0;
};

/// What a map file needs so that TiledMap reads it tile by tile.
MapIndex indexForTiles(const SparseMap& map);

}  // namespace vcharge
