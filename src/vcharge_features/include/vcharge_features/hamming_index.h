#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {

/// Finds binary descriptors that differ from a query in few bits, by looking up pieces of 16 bits that are
/// equal (multi-index hashing: Norouzi, Punjani and Fleet, CVPR 2012, without their search of neighbouring
/// pieces). If bits differ at random, one of 8 pieces is equal with a probability of 99, 96 and 68 % for 10,
/// 20 and 30 different bits of 256. Immutable.
class HammingIndex {
 public:
  /// `descriptors`: CV_8UC1 with 32 columns, shared, not copied. `num_pieces`, at most 16: more pieces find
  /// more descriptors and need 4 bytes of memory per descriptor each. Throws std::invalid_argument for
  /// others.
  explicit HammingIndex(const cv::Mat& descriptors, int num_pieces = 8);

  /// Most of the descriptors (see above) that differ from `query` (32 bytes) in at most `max_distance` bits,
  /// ascending by index.
  std::vector<DescriptorNeighbour> near(const uint8_t* query, int max_distance) const;
  int size() const { return descriptors_.rows; }

 private:
  struct Table {
    std::vector<int32_t> begin;    ///< first index per value of the piece, plus the end
    std::vector<int32_t> indices;  ///< indices of descriptors, ordered by value
  };

  const cv::Mat descriptors_;
  std::vector<Table> tables_;
  int32_t max_bucket_ = 0;
};

}  // namespace vcharge
