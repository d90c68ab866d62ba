#include "vcharge_features/place_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

namespace vcharge {
namespace {

constexpr int kBits = 256;

cv::Mat randomDescriptors(int count, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat descriptors(count, kBits / 8, CV_8UC1);
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < descriptors.cols; ++column) {
      descriptors.at<uint8_t>(row, column) = static_cast<uint8_t>(random());
    }
  }
  return descriptors;
}

/// A copy in which `count` different bits are flipped.
cv::Mat withFlips(const cv::Mat& descriptor, int count, std::mt19937* random) {
  cv::Mat flipped = descriptor.clone();
  std::vector<int> bits(kBits);
  for (int i = 0; i < kBits; ++i) {
    bits[static_cast<size_t>(i)] = i;
  }
  for (int i = 0; i < count; ++i) {
    std::swap(bits[static_cast<size_t>(i)],
              bits[static_cast<size_t>(i) + (*random)() % static_cast<unsigned>(kBits - i)]);
    const int bit = bits[static_cast<size_t>(i)];
    flipped.at<uint8_t>(0, bit / 8) ^= static_cast<uint8_t>(1U << (bit % 8));
  }
  return flipped;
}

PlaceFeature featureOf(const cv::Mat& signature, int place) {
  PlaceFeature feature;
  std::copy_n(signature.ptr(), feature.signature.size(), feature.signature.begin());
  feature.first_place = place;
  return feature;
}

MemoryPlaceTable tableOf(const cv::Mat& signatures) {
  std::vector<PlaceFeature> features;
  for (int i = 0; i < signatures.rows; ++i) {
    features.push_back(featureOf(signatures.row(i), i));
  }
  return MemoryPlaceTable(std::move(features));
}

/// How many pieces of a signature lead to a place.
int numPiecesThatFind(const PlaceTable& table, const cv::Mat& signature, int place) {
  int count = 0;
  std::vector<PlaceFeature> features;
  for (int piece = 0; piece < PlaceTable::kNumPieces; ++piece) {
    table.readBucket(PlaceTable::bucketOf(signature.ptr(), piece), &features);
    count += static_cast<int>(std::count_if(
        features.begin(), features.end(), [&](const auto& feature) { return feature.first_place == place; }));
  }
  return count;
}

/// Fraction of flipped signatures whose original is found.
double fractionFound(int num_flips) {
  const cv::Mat signatures = randomDescriptors(5000, 1);
  const MemoryPlaceTable table = tableOf(signatures);
  std::mt19937 random(2);
  int found = 0;
  const int trials = 2000;
  for (int i = 0; i < trials; ++i) {
    found += numPiecesThatFind(table, withFlips(signatures.row(i), num_flips, &random), i) > 0;
  }
  return static_cast<double>(found) / trials;
}

TEST(PlaceTableTest, FindsAllThatLeaveOnePieceEqual) {
  EXPECT_EQ(fractionFound(0), 1.0);
  EXPECT_EQ(fractionFound(7), 1.0);
}

TEST(PlaceTableTest, FindsTheDocumentedFractionOfFartherOnes) {
  // At least one piece is equal with probability 1 - (1 - C(240, n) / C(256, n))^pieces, approximately.
  EXPECT_NEAR(fractionFound(20), 0.93, 0.03);
  EXPECT_NEAR(fractionFound(30), 0.68, 0.04);
}

TEST(PlaceTableTest, PiecesThatAllHaveAreLeftOut) {
  cv::Mat signatures = randomDescriptors(1000, 1);
  signatures.colRange(0, 4).setTo(7);
  EXPECT_EQ(numPiecesThatFind(tableOf(signatures), signatures.row(3), 3), PlaceTable::kNumPieces - 2);
}

TEST(PlaceSignaturesTest, TakesDescriptorsOfOneKind) {
  const cv::Mat numbers = cv::Mat::eye(3, 64, CV_32FC1);
  EXPECT_EQ(PlaceSignatures::learnedFrom(numbers).of(numbers).size(), cv::Size(32, 3));
  const cv::Mat bits = randomDescriptors(2, 1);
  EXPECT_EQ(cv::norm(PlaceSignatures::learnedFrom(bits).of(bits), bits, cv::NORM_INF), 0.0);
  EXPECT_TRUE(PlaceSignatures::learnedFrom(cv::Mat()).of(cv::Mat()).empty());
  EXPECT_THROW(PlaceSignatures::learnedFrom(bits).of(numbers), std::invalid_argument);
  EXPECT_THROW(PlaceSignatures::learnedFrom(numbers).of(cv::Mat::eye(3, 128, CV_32FC1)),
               std::invalid_argument);
  EXPECT_THROW(PlaceSignatures::learnedFrom(cv::Mat::zeros(3, 16, CV_8UC1)), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
