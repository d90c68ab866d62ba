#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/sparse_map/map_tile_reader.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_features/place_table.h"

namespace vcharge {

/// The features by which the keyframes of a map are recognized: of each landmark, as each camera saw it at
/// consecutive keyframes, the descriptor that is the most similar to the others.
std::vector<PlaceFeature> placeFeaturesOf(const SparseMap& map, const PlaceSignatures& signatures);

/// Median distance between descriptors of different landmarks, of a random sample; 0 if there are none.
double medianUnrelatedDistance(const SparseMap& map);

/// The table in a map's file. The reader must outlive it.
class FilePlaceTable : public PlaceTable {
 public:
  explicit FilePlaceTable(const MapTileReader& reader) : reader_(reader) {}

  void readBucket(int bucket, std::vector<PlaceFeature>* features) const override;

 private:
  const MapTileReader& reader_;
};

/// A row of the table in a file.
std::vector<uint8_t> bytesOf(const std::vector<PlaceFeature>& features);

}  // namespace vcharge
