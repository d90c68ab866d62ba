#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// A square of the map's x-y plane, kTileSize_m wide, with a corner at (x, y) * kTileSize_m.
struct MapTile {
  int32_t x = 0;
  int32_t y = 0;

  bool operator<(const MapTile& other) const { return x != other.x ? x < other.x : y < other.y; }
};

constexpr double kTileSize_m = 20.0;

/// The tile in which a position of the map frame lies.
MapTile tileAt(const Eigen::Vector3d& position_m);

/// Indices of the keyframes in each tile, ascending.
std::map<MapTile, std::vector<size_t>> tilesOf(const std::vector<MapKeyframe>& keyframes);

/// What does not grow with a map.
SparseMapContents headOf(const SparseMapContents& whole);

/// A map without observations, landmarks, loop edges and covariances of keyframes.
SparseMapContents overviewOf(const SparseMap& map);

/// The keyframes with these indices (ascending) as a map: with all that they observe and all sessions, but
/// without the keyframes' covariances and loop edges. Ids are those of the map.
std::shared_ptr<const SparseMap> partOf(const SparseMap& map, const std::vector<size_t>& keyframes);

}  // namespace vcharge
