#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {

struct HammingIndexOptions {
  /// Pieces of 16 bits by which descriptors are looked up, at most 16; more find more, and take more memory
  /// (4 bytes a descriptor each).
  int num_pieces = 8;
  /// A piece that this many times as many descriptors have as on average tells nothing; it is not looked up.
  double max_crowding = 16.0;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("num_pieces", num_pieces);
    visit("max_crowding", max_crowding);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Finds the binary descriptors that differ from another in few bits, by pieces that are equal (multi-index
/// hashing: Norouzi, Punjani and Fleet, CVPR 2012, without their search of neighbouring pieces). Where bits
/// differ at random, one of 8 pieces is equal with a probability of 99, 96 and 68 % at 10, 20 and 30 of 256.
/// Immutable.
class HammingIndex {
 public:
  /// CV_8UC1 with 32 columns; the pixels are shared, not copied. std::invalid_argument for others, and for
  /// bad options.
  explicit HammingIndex(const cv::Mat& descriptors,
                        const HammingIndexOptions& options = HammingIndexOptions());

  /// Descriptors that differ from `query` (32 bytes) in at most `max_distance` bits, ascending by index; most
  /// of them (see above).
  std::vector<DescriptorNeighbour> near(const uint8_t* query, int max_distance) const;

  int size() const { return descriptors_.rows; }

 private:
  struct Table {
    std::vector<int32_t> begin;    ///< by value of the piece; one more than values
    std::vector<int32_t> indices;  ///< of descriptors, by value
  };
  const cv::Mat descriptors_;
  std::vector<Table> tables_;
  int32_t max_bucket_ = 0;
};

}  // namespace vcharge
