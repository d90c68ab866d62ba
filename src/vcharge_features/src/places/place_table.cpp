#include "vcharge_features/place_table.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "matching/binary_signature.h"
#include "matching/matching_internal.h"

namespace vcharge {
namespace {

/// Buckets with this many times more features than the average one are left out.
constexpr double kMaxCrowding = 16.0;
/// Buckets of this size are never left out, since they cost nothing.
constexpr int32_t kSmallBucket = 64;

}  // namespace

PlaceSignatures PlaceSignatures::learnedFrom(const cv::Mat& descriptors) {
  const bool is_binary =
      descriptors.rows == 0 || checkDescriptors(descriptors, "PlaceSignatures", "descriptors");
  return PlaceSignatures(is_binary ? cv::Mat() : meanDescriptor(descriptors));
}

cv::Mat PlaceSignatures::of(const cv::Mat& descriptors) const {
  if (descriptors.rows == 0) {
    return {};
  }
  const bool is_binary = checkDescriptors(descriptors, "PlaceSignatures", "descriptors");
  if (is_binary != mean_.empty() || (!is_binary && descriptors.cols != mean_.cols)) {
    throw std::invalid_argument("PlaceSignatures: expected descriptors of the places' kind");
  }
  return is_binary ? descriptors : binarySignatures(descriptors, mean_);
}

int PlaceTable::bucketOf(const uint8_t* signature, int piece) {
  return piece * kNumValues + signature[2 * piece] + (signature[2 * piece + 1] << 8);
}

MemoryPlaceTable::MemoryPlaceTable(std::vector<PlaceFeature> features)
    : features_(std::move(features)),
      begin_(kNumBuckets + 1, 0),
      indices_(kNumPieces * features_.size()),
      max_size_(std::max(kSmallBucket, static_cast<int32_t>(kMaxCrowding * features_.size() / kNumValues))) {
  const auto forEach = [&](const auto& function) {
    for (size_t i = 0; i < features_.size(); ++i) {
      for (int piece = 0; piece < kNumPieces; ++piece) {
        function(static_cast<size_t>(bucketOf(features_[i].signature.data(), piece)),
                 static_cast<int32_t>(i));
      }
    }
  };
  forEach([&](size_t bucket, int32_t) { ++begin_[bucket + 1]; });
  for (size_t bucket = 0; bucket < kNumBuckets; ++bucket) {
    begin_[bucket + 1] += begin_[bucket];
  }
  std::vector<int32_t> next(begin_.begin(), begin_.end() - 1);
  forEach([&](size_t bucket, int32_t i) { indices_[static_cast<size_t>(next[bucket]++)] = i; });
}

void MemoryPlaceTable::readBucket(int bucket, std::vector<PlaceFeature>* features) const {
  features->clear();
  const int32_t begin = begin_[static_cast<size_t>(bucket)], end = begin_[static_cast<size_t>(bucket) + 1];
  if (end - begin > max_size_) {
    return;
  }
  for (int32_t i = begin; i < end; ++i) {
    features->push_back(features_[static_cast<size_t>(indices_[static_cast<size_t>(i)])]);
  }
}

}  // namespace vcharge
