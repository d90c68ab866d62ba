#include "vcharge_features/hamming_index.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <stdexcept>
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

/// Fraction of flipped descriptors whose original is found.
double fractionFound(int num_flips, int num_pieces) {
  const cv::Mat descriptors = randomDescriptors(5000, 1);
  const HammingIndex index(descriptors, num_pieces);
  std::mt19937 random(2);
  int found = 0;
  const int trials = 2000;
  for (int i = 0; i < trials; ++i) {
    const cv::Mat query = withFlips(descriptors.row(i), num_flips, &random);
    for (const DescriptorNeighbour& neighbour : index.near(query.ptr(), num_flips)) {
      EXPECT_EQ(neighbour.index, i) << "others are about 128 bits away";
      EXPECT_EQ(neighbour.distance, static_cast<float>(num_flips));
      ++found;
    }
  }
  return static_cast<double>(found) / trials;
}

TEST(HammingIndexTest, FindsAllThatLeaveOnePieceEqual) {
  EXPECT_EQ(fractionFound(0, 8), 1.0);
  EXPECT_EQ(fractionFound(7, 8), 1.0);
  EXPECT_EQ(fractionFound(15, 16), 1.0);
}

TEST(HammingIndexTest, FindsTheDocumentedFractionOfFartherOnes) {
  // At least one piece is equal with probability 1 - (1 - C(240, n) / C(256, n))^pieces, approximately.
  EXPECT_NEAR(fractionFound(20, 8), 0.93, 0.03);
  EXPECT_NEAR(fractionFound(30, 8), 0.68, 0.04);
  EXPECT_GT(fractionFound(30, 16), fractionFound(30, 8) + 0.1);
}

TEST(HammingIndexTest, LeavesOutWhatIsTooFar) {
  const cv::Mat descriptors = randomDescriptors(100, 1);
  const HammingIndex index(descriptors);
  std::mt19937 random(3);
  const cv::Mat query = withFlips(descriptors.row(5), 6, &random);
  EXPECT_TRUE(index.near(query.ptr(), 5).empty());
  ASSERT_EQ(index.near(query.ptr(), 6).size(), 1U);
}

TEST(HammingIndexTest, PiecesThatAllHaveAreNotLookedUp) {
  // The first two pieces of all descriptors are equal, so they find nothing.
  cv::Mat descriptors = randomDescriptors(1000, 1);
  descriptors.colRange(0, 4).setTo(7);
  EXPECT_TRUE(HammingIndex(descriptors, 2).near(descriptors.ptr(3), 0).empty());
  EXPECT_EQ(HammingIndex(descriptors, 3).near(descriptors.ptr(3), 0).size(), 1U);
}

TEST(HammingIndexTest, NoDescriptorsAndBadOnes) {
  const cv::Mat query = randomDescriptors(1, 1);
  EXPECT_TRUE(HammingIndex(cv::Mat()).near(query.ptr(), 256).empty());
  EXPECT_THROW(HammingIndex(cv::Mat::zeros(3, 128, CV_32FC1)), std::invalid_argument);
  EXPECT_THROW(HammingIndex(cv::Mat::zeros(3, 16, CV_8UC1)), std::invalid_argument);
  EXPECT_THROW(HammingIndex(query, 17), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
