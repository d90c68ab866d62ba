#include "vcharge_features/hamming_index.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "matching/descriptor_kernels.h"
#include "matching/matching_internal.h"

namespace vcharge {
namespace {

constexpr size_t kPieceBytes = 2;
constexpr size_t kNumValues = size_t{1} << (8 * kPieceBytes);
constexpr int kMaxPieces = static_cast<int>(kBinaryDescriptorBytes / kPieceBytes);
/// A piece that this many times more descriptors have than on average is not distinctive and not looked up.
constexpr double kMaxCrowding = 16.0;
/// Buckets of this size are always searched, since they cost nothing.
constexpr int32_t kSmallBucket = 64;

/// Does not depend on the machine's byte order.
size_t pieceOf(const uint8_t* descriptor, size_t piece) {
  return static_cast<size_t>(descriptor[kPieceBytes * piece]) |
         (static_cast<size_t>(descriptor[kPieceBytes * piece + 1]) << 8);
}

}  // namespace

HammingIndex::HammingIndex(const cv::Mat& descriptors, int num_pieces) : descriptors_(descriptors) {
  requireField(num_pieces >= 1 && num_pieces <= kMaxPieces, "num_pieces", "must be in [1, 16]", num_pieces);
  if (descriptors.rows > 0 && !checkDescriptors(descriptors, "HammingIndex", "descriptors")) {
    throw std::invalid_argument("HammingIndex: descriptors: expected binary ones");
  }
  const auto count = static_cast<size_t>(descriptors_.rows);
  const double average = static_cast<double>(count) / kNumValues;
  max_bucket_ = std::max(kSmallBucket, static_cast<int32_t>(kMaxCrowding * average));
  tables_.resize(static_cast<size_t>(num_pieces));
  tbb::parallel_for(size_t{0}, tables_.size(), [&](size_t piece) {
    Table& table = tables_[piece];
    table.begin.assign(kNumValues + 1, 0);
    for (int i = 0; i < descriptors_.rows; ++i) {
      ++table.begin[pieceOf(descriptors_.ptr(i), piece) + 1];
    }
    for (size_t value = 0; value < kNumValues; ++value) {
      table.begin[value + 1] += table.begin[value];
    }
    std::vector<int32_t> next(table.begin.begin(), table.begin.end() - 1);
    table.indices.resize(count);
    for (int i = 0; i < descriptors_.rows; ++i) {
      table.indices[static_cast<size_t>(next[pieceOf(descriptors_.ptr(i), piece)]++)] = i;
    }
  });
}

std::vector<DescriptorNeighbour> HammingIndex::near(const uint8_t* query, int max_distance) const {
  std::vector<int32_t> candidates;
  for (size_t piece = 0; piece < tables_.size(); ++piece) {
    const Table& table = tables_[piece];
    const size_t value = pieceOf(query, piece);
    const int32_t begin = table.begin[value], end = table.begin[value + 1];
    if (end - begin <= max_bucket_) {
      candidates.insert(candidates.end(), table.indices.begin() + begin, table.indices.begin() + end);
    }
  }
  std::vector<float> distances(candidates.size());
  hammingToRows(query, descriptors_.ptr(), descriptors_.step, candidates.data(), candidates.size(),
                distances.data());
  std::vector<DescriptorNeighbour> found;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (distances[i] <= static_cast<float>(max_distance)) {
      found.push_back({candidates[i], distances[i]});
    }
  }
  // Descriptors with several equal pieces are found several times.
  const auto byIndex = [](const DescriptorNeighbour& a, const DescriptorNeighbour& b) {
    return a.index < b.index;
  };
  std::sort(found.begin(), found.end(), byIndex);
  found.erase(std::unique(found.begin(), found.end(),
                          [](const DescriptorNeighbour& a, const DescriptorNeighbour& b) {
                            return a.index == b.index;
                          }),
              found.end());
  return found;
}

}  // namespace vcharge
