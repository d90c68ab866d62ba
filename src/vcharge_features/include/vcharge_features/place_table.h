#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Turns descriptors into signatures of 256 bits. Binary descriptors are their own signatures; each bit of
/// those of numbers says which of two numbers is larger relative to its mean.
class PlaceSignatures {
 public:
  /// For descriptors like these. std::invalid_argument for descriptors that are neither CV_8UC1 with 32
  /// columns nor CV_32FC1, or not finite.
  static PlaceSignatures learnedFrom(const cv::Mat& descriptors);

  /// Whether there are signatures of descriptors with this type and number of columns.
  static bool fits(int type, int columns) { return type == CV_32FC1 || (type == CV_8UC1 && columns == 32); }

  /// `mean`: mean of the descriptors, CV_32FC1 with one row; empty for binary ones.
  explicit PlaceSignatures(cv::Mat mean) : mean_(std::move(mean)) {}

  /// One row of 32 bytes per descriptor. std::invalid_argument for descriptors of another kind.
  cv::Mat of(const cv::Mat& descriptors) const;
  const cv::Mat& mean() const { return mean_; }

 private:
  cv::Mat mean_;
};

/// A feature that one camera saw at consecutive places.
struct PlaceFeature {
  std::array<uint8_t, 32> signature{};
  int32_t first_place = 0;
  int32_t num_places = 1;
  int32_t camera = 0;
};

/// Features by pieces of 16 bits of their signatures (multi-index hashing: Norouzi, Punjani and Fleet, CVPR
/// 2012, without their search of neighbouring pieces). If bits differ at random, one of 8 pieces is equal
/// with a probability of 99, 96 and 68 % for 10, 20 and 30 different bits of 256.
class PlaceTable {
 public:
  static constexpr int kNumPieces = 8;
  static constexpr int kNumValues = 1 << 16;
  static constexpr int kNumBuckets = kNumPieces * kNumValues;

  virtual ~PlaceTable() = default;

  /// The features whose signatures have a piece with a value: those of bucket piece * kNumValues + value.
  /// Buckets with many times more features than the others are not distinctive, and empty.
  virtual void readBucket(int bucket, std::vector<PlaceFeature>* features) const = 0;

  /// The bucket of a piece of a signature. Does not depend on the machine's byte order.
  static int bucketOf(const uint8_t* signature, int piece);
};

/// A table in memory. Immutable.
class MemoryPlaceTable : public PlaceTable {
 public:
  explicit MemoryPlaceTable(std::vector<PlaceFeature> features);

  void readBucket(int bucket, std::vector<PlaceFeature>* features) const override;

 private:
  const std::vector<PlaceFeature> features_;
  std::vector<int32_t> begin_;    ///< first index per bucket, plus the end
  std::vector<int32_t> indices_;  ///< indices of features, by bucket
  int32_t max_size_;
};

}  // namespace vcharge
