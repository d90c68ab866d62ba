#include "vcharge_evaluation/range_gaps.h"

#include <limits>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

const cv::Size kSize(64, 32);  // 8 x 4 cells
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

cv::Mat makeRanges(int num_unknown_columns) {
  cv::Mat range_m(kSize, CV_32FC1, cv::Scalar(2.0));
  range_m.colRange(0, num_unknown_columns).setTo(kNan);
  return range_m;
}

const cv::Mat kValid(kSize, CV_8UC1, cv::Scalar(255));
const cv::Mat kTruth(kSize, CV_32FC1, cv::Scalar(2.0));

TEST(RangeGapsTest, CellsUnknownForLongAreCounted) {
  RangeGaps gaps;
  for (int k = 0; k < 7; ++k) {
    gaps.add(makeRanges(k < 6 ? 16 : 0), kTruth, kValid);
  }
  const RangeGapCounts counts = gaps.counts();
  EXPECT_EQ(counts.num_cells, 32U);
  EXPECT_EQ(counts.num_gap_cells, 8U);
  EXPECT_EQ(counts.longest_gap, 6);
  EXPECT_NEAR(counts.fraction_known, 1.0 - 6.0 * 8.0 / (7.0 * 32.0), 1e-12);
}

TEST(RangeGapsTest, KnownRangesEndAGap) {
  RangeGaps gaps;
  for (int k = 0; k < 11; ++k) {
    gaps.add(makeRanges(k == 5 ? 0 : 16), kTruth, kValid);
  }
  EXPECT_EQ(gaps.counts().num_gap_cells, 0U);
  EXPECT_EQ(gaps.counts().longest_gap, 5);
}

TEST(RangeGapsTest, FarSurfacesAndTheOwnVehicleAreLeftOut) {
  RangeGaps gaps;
  cv::Mat truth = kTruth.clone();
  truth.rowRange(0, 8).setTo(5.0);
  truth.rowRange(8, 16).setTo(kNan);
  cv::Mat valid = kValid.clone();
  valid.colRange(0, 16).setTo(0);
  for (int k = 0; k < 7; ++k) {
    gaps.add(makeRanges(64), truth, valid);
  }
  EXPECT_EQ(gaps.counts().num_cells, 12U);
  EXPECT_EQ(gaps.counts().num_gap_cells, 12U);
  EXPECT_EQ(gaps.counts().fraction_known, 0.0);
}

TEST(RangeGapsTest, OtherSizesAreRefused) {
  RangeGaps gaps;
  EXPECT_THROW(gaps.add(makeRanges(0), cv::Mat(8, 8, CV_32FC1, cv::Scalar(1.0)), kValid), std::logic_error);
  EXPECT_EQ(gaps.counts().num_cells, 0U);
}

}  // namespace
}  // namespace vcharge
