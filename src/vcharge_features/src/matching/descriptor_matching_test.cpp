#include "vcharge_features/descriptor_matching.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <opencv2/features2d.hpp>
#include <random>

namespace vcharge {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Few different bits cause many ties.
cv::Mat randomBinary(int rows, unsigned seed, uint32_t bits = 0xFFFFFFFFU) {
  std::mt19937 generator(seed);
  cv::Mat descriptors(rows, 32, CV_8UC1);
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < 32; ++k) {
      descriptors.at<uint8_t>(i, k) = static_cast<uint8_t>(generator() & (k == 0 ? bits : bits >> 8));
    }
  }
  return descriptors;
}

/// Whole numbers, like SIFT's, whose squared distances are exact in any order of summation.
cv::Mat randomFloat(int rows, int columns, unsigned seed, unsigned values = 256) {
  std::mt19937 generator(seed);
  cv::Mat descriptors(rows, columns, CV_32FC1);
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < columns; ++k) {
      descriptors.at<float>(i, k) = static_cast<float>(generator() % values);
    }
  }
  return descriptors;
}

void expectEqualToOpenCv(const cv::Mat& first, const cv::Mat& second) {
  const DescriptorNeighbours found = findDescriptorNeighbours(first, second);
  const cv::BFMatcher matcher(first.type() == CV_8UC1 ? cv::NORM_HAMMING : cv::NORM_L2);
  std::vector<std::vector<cv::DMatch>> forward;
  std::vector<cv::DMatch> reverse;
  matcher.knnMatch(first, second, forward, 2);
  matcher.match(second, first, reverse);
  ASSERT_EQ(forward.size(), found.of_first.size());
  ASSERT_EQ(reverse.size(), found.of_second.size());
  for (size_t i = 0; i < forward.size(); ++i) {
    ASSERT_EQ(forward[i][0].trainIdx, found.of_first[i].best.index) << i;
    ASSERT_EQ(forward[i][0].distance, found.of_first[i].best.distance) << i;
    if (forward[i].size() > 1) {
      ASSERT_EQ(forward[i][1].trainIdx, found.of_first[i].second.index) << i;
      ASSERT_EQ(forward[i][1].distance, found.of_first[i].second.distance) << i;
    } else {
      ASSERT_EQ(-1, found.of_first[i].second.index) << i;
    }
  }
  for (size_t i = 0; i < reverse.size(); ++i) {
    ASSERT_EQ(reverse[i].trainIdx, found.of_second[i].index) << i;
    ASSERT_EQ(reverse[i].distance, found.of_second[i].distance) << i;
  }
}

/// Runs once per instruction set that both the build and the processor support.
class DescriptorNeighboursTest : public ::testing::TestWithParam<int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

TEST_P(DescriptorNeighboursTest, BinaryOnesAreThoseOfOpenCv) {
  unsigned seed = 0;
  for (const int first : {1, 2, 31, 128, 129, 300}) {
    for (const int second : {1, 2, 15, 33, 64, 127, 257, 500}) {
      seed += 2;
      expectEqualToOpenCv(randomBinary(first, seed), randomBinary(second, seed + 1));
      expectEqualToOpenCv(randomBinary(first, seed, 0x101), randomBinary(second, seed + 1, 0x301));
    }
  }
}

TEST_P(DescriptorNeighboursTest, BinaryOnesPastOneBlockOfTrainsAreThoseOfOpenCv) {
  expectEqualToOpenCv(randomBinary(260, 1, 0x103), randomBinary(4999, 2, 0x301));
}

TEST_P(DescriptorNeighboursTest, AllEqualAndAllOppositeDescriptorsAreThoseOfOpenCv) {
  const cv::Mat zeros = cv::Mat::zeros(70, 32, CV_8UC1);
  const cv::Mat ones(131, 32, CV_8UC1, cv::Scalar(255));
  expectEqualToOpenCv(zeros, ones);
  expectEqualToOpenCv(zeros, zeros);
}

TEST_P(DescriptorNeighboursTest, RowsOfALargerMatrixAreRead) {
  const cv::Mat wide = randomBinary(40, 3);
  cv::Mat padded(40, 50, CV_8UC1, cv::Scalar(7));
  wide.copyTo(padded(cv::Rect(9, 0, 32, 40)));
  const DescriptorNeighbours expected = findDescriptorNeighbours(wide, randomBinary(30, 4));
  const DescriptorNeighbours found =
      findDescriptorNeighbours(padded(cv::Rect(9, 0, 32, 40)), randomBinary(30, 4));
  for (size_t i = 0; i < expected.of_first.size(); ++i) {
    EXPECT_EQ(expected.of_first[i].second.index, found.of_first[i].second.index);
  }
}

TEST_P(DescriptorNeighboursTest, NumbersAreThoseOfOpenCv) {
  unsigned seed = 100;
  for (const int columns : {1, 3, 64, 128}) {
    for (const int first : {1, 7, 8, 17, 40}) {
      for (const int second : {1, 2, 16, 31, 70}) {
        seed += 2;
        expectEqualToOpenCv(randomFloat(first, columns, seed), randomFloat(second, columns, seed + 1));
        expectEqualToOpenCv(randomFloat(first, columns, seed, 2), randomFloat(second, columns, seed + 1, 2));
      }
    }
  }
}

TEST_P(DescriptorNeighboursTest, DistancesOfNumbersAreRightToRounding) {
  std::mt19937 generator(5);
  cv::Mat first(9, 128, CV_32FC1), second(21, 128, CV_32FC1);
  for (cv::Mat* mat : {&first, &second}) {
    for (int i = 0; i < static_cast<int>(mat->total()); ++i) {
      mat->at<float>(i / 128, i % 128) = std::ldexp(static_cast<float>(generator()), -32);
    }
  }
  for (const TwoNearestDescriptors& nearest : findDescriptorNeighbours(first, second).of_first) {
    ASSERT_GE(nearest.second.index, 0);
    EXPECT_LE(nearest.best.distance, nearest.second.distance);
  }
  const DescriptorNeighbours found = findDescriptorNeighbours(first, second);
  for (int i = 0; i < first.rows; ++i) {
    const double exact = cv::norm(first.row(i), second.row(found.of_first[i].best.index), cv::NORM_L2);
    EXPECT_NEAR(exact, found.of_first[i].best.distance, 1e-6 * exact);
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, DescriptorNeighboursTest,
                         ::testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& parameter) { return hwy::TargetName(parameter.param); });

TEST(DescriptorMatchingTest, NoDescriptorsHaveNoNeighbours) {
  const cv::Mat some = randomBinary(5, 1);
  for (const cv::Mat& none : {cv::Mat(), cv::Mat(0, 32, CV_8UC1)}) {
    EXPECT_EQ(findDescriptorNeighbours(some, none).of_first[4].best.index, -1);
    EXPECT_EQ(findDescriptorNeighbours(none, some).of_second[4].index, -1);
    EXPECT_TRUE(matchDescriptors(some, none).empty());
    EXPECT_TRUE(matchDescriptors(none, some).empty());
    EXPECT_TRUE(matchDescriptors(none, none).empty());
  }
}

TEST(DescriptorMatchingTest, OtherKindsOfDescriptorsAreErrors) {
  const cv::Mat binary = randomBinary(3, 1);
  const cv::Mat numbers = randomFloat(3, 128, 1);
  const auto throwing = [](const char* text) {
    return ThrowsMessage<std::invalid_argument>(HasSubstr(text));
  };
  EXPECT_THAT([&] { matchDescriptors(binary, numbers); }, throwing("of one kind"));
  EXPECT_THAT([&] { matchDescriptors(randomFloat(3, 64, 1), numbers); }, throwing("of one kind"));
  EXPECT_THAT([&] { matchDescriptors(cv::Mat::zeros(3, 31, CV_8UC1), binary); }, throwing("first"));
  EXPECT_THAT([&] { matchDescriptors(binary, cv::Mat::zeros(3, 32, CV_16SC1)); }, throwing("second"));
  cv::Mat broken = numbers.clone();
  broken.at<float>(1, 5) = std::nanf("");
  EXPECT_THAT([&] { matchDescriptors(numbers, broken); }, throwing("second: descriptors must be finite"));
  MatchOptions options;
  options.max_ratio = std::nan("");
  EXPECT_THAT([&] { matchDescriptors(binary, binary, options); }, throwing("max_ratio"));
  options = MatchOptions();
  options.max_distance = -1.0;
  EXPECT_THAT([&] { matchDescriptors(binary, binary, options); }, throwing("max_distance"));
}

TEST(DescriptorMatchingTest, RatioMutualAndDistanceChecksDropWhatTheyShould) {
  // On a line: 0 is nearest to 1 (second nearest 4), 10 nearest to 11 and 9, which tie.
  const cv::Mat first = (cv::Mat_<float>(3, 1) << 0.0F, 10.0F, 30.0F);
  const cv::Mat second = (cv::Mat_<float>(5, 1) << 1.0F, 4.0F, 11.0F, 9.0F, 20.0F);
  MatchOptions options;
  options.max_ratio = 0.5;
  std::vector<FeatureMatch> matches = matchDescriptors(first, second, options);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].second_index, 0);
  EXPECT_EQ(matches[0].distance, 1.0F);
  options.max_ratio = 1.0;
  matches = matchDescriptors(first, second, options);
  ASSERT_EQ(matches.size(), 2U) << "20 is nearer to 10 than to 30";
  EXPECT_EQ(matches[1].second_index, 2) << "of two equal distances the first";
  options.max_distance = 0.5;
  EXPECT_TRUE(matchDescriptors(first, second, options).empty());
}

}  // namespace
}  // namespace vcharge
