#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "vcharge_core/sparse_map/map_tile.h"
#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// Reads the newest version of a map file tile by tile. Only poses of keyframes are in memory, so that a file
/// opens at once whatever its size. What is read is checked against the hashes in the file. The reader goes
/// on with its version if the file is replaced. Safe to use from several threads. Every error is an
/// InputError that names the file.
class MapTileReader {
 public:
  /// Opens a file. Null for a file without tiles, which is to be read as a whole.
  static std::unique_ptr<MapTileReader> open(const std::string& path);
  ~MapTileReader();

  /// Everything but observations, landmarks and covariances of keyframes; without loop edges.
  const SparseMapContents& overview() const { return overview_->contents(); }
  /// The MapIndex's info.
  const std::map<std::string, std::string>& info() const { return info_; }
  /// Indices of the keyframes in each tile, as of tilesOf().
  const std::map<MapTile, std::vector<size_t>>& tiles() const { return tiles_; }

  /// A tile as a map: partOf() with the tile's keyframes. std::out_of_range for a tile without keyframes.
  std::shared_ptr<const SparseMap> readTile(const MapTile& tile) const;

  /// A row of the MapIndex; empty if there is none.
  std::vector<uint8_t> readPlaceRow(int64_t id) const;

 private:
  struct Connection;
  explicit MapTileReader(std::unique_ptr<Connection> connection);

  mutable std::mutex mutex_;  // guards the connection
  std::unique_ptr<Connection> connection_;
  std::unique_ptr<const SparseMap> overview_;
  std::map<std::string, std::string> info_;
  std::map<MapTile, std::vector<size_t>> tiles_;
};

}  // namespace vcharge
