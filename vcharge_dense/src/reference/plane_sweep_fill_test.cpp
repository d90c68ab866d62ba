#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {
namespace {

/// Ground and a wall whose texture is too weak for small windows.
AnalyticScene faintScene() {
  return AnalyticScene(
      {{{0, 0, 0}, {0, 0, 1}}, {{0, 5.0, 0}, {0, -1, 0}, Eigen::Vector3d::Constant(1e6), 0.12}}, 3);
}

Sequence faintSequence() {
  return makeSequence(faintScene(), kLeft, 0.2, -4, 0, 1.0);
}

PlaneSweepOptions filling(int num_levels) {
  PlaneSweepOptions options;
  options.min_texture = 2.0;  // most of the wall's windows have less
  options.num_fill_levels = num_levels;
  return options;
}

TEST(PlaneSweepFillTest, UnknownPixelsTakeRightRangesAndKnownOnesStay) {
  const Sequence s = faintSequence();
  const RangeMap before = sweepOf(s, filling(0));
  for (const int levels : {1, 2}) {
    const RangeMap after = sweepOf(s, filling(levels));
    int known = 0, filled = 0, right = 0;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const float range = after.range_m.at<float>(y, x);
        if (std::isfinite(before.range_m.at<float>(y, x))) {
          ++known;
          ASSERT_EQ(range, before.range_m.at<float>(y, x));
          ASSERT_EQ(after.standard_deviation_m.at<float>(y, x), before.standard_deviation_m.at<float>(y, x));
          ASSERT_EQ(after.confidence.at<float>(y, x), before.confidence.at<float>(y, x));
        } else if (std::isfinite(range)) {
          ASSERT_GT(after.standard_deviation_m.at<float>(y, x), 0.0F);
          ASSERT_GE(after.confidence.at<float>(y, x), filling(0).min_confidence);
          if (after.confidence.at<float>(y, x) >= 0.5F) {
            const double truth = s.truth.at<double>(y, x);
            ++filled;
            right += std::abs(range - truth) < 0.05 * truth ? 1 : 0;
          }
        }
      }
    }
    RecordProperty("known" + std::to_string(levels), known);
    RecordProperty("filled" + std::to_string(levels), filled);
    RecordProperty("right" + std::to_string(levels), right);
    EXPECT_GT(known, 10000);
    EXPECT_GT(filled, 1600 + 600 * levels);
    EXPECT_GT(right, 0.93 * filled);
  }
}

TEST(PlaneSweepFillTest, WithACoarsePassToo) {
  const Sequence s = faintSequence();
  PlaneSweepOptions options = filling(0);
  options.coarse_pass = true;
  const int before = cv::countNonZero(sweepOf(s, options).confidence > 0.0F);
  options.num_fill_levels = 2;
  EXPECT_GT(cv::countNonZero(sweepOf(s, options).confidence > 0.0F), before + 1500);
}

TEST(PlaneSweepFillTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = faintSequence();
  expectTheSameOnAnyNumberOfThreads(filling(2), s);
}

TEST(PlaneSweepFillTest, OddAndSmallImagesWork) {
  for (const cv::Size size : {cv::Size(101, 77), cv::Size(35, 40), cv::Size(16, 40)}) {
    const cv::Rect part(60, 60, size.width, size.height);
    Sequence s = faintSequence();
    crop(part, &s);
    const MeiCamera camera = croppedCamera(part);
    const PlaneSweep sweep(camera, cv::Mat(size, CV_8UC1, cv::Scalar(255)), filling(4), s.ground);
    EXPECT_EQ(sweep.sweep(s.reference, s.neighbours).range_m.size(), size);
    EXPECT_EQ(cv::countNonZero(sweep.sweep(s.reference, {}).confidence), 0);  // no neighbours
  }
}

TEST(PlaneSweepFillTest, InvalidPixelsStayUnknown) {
  const Sequence s = faintSequence();
  cv::Mat valid = allValid();
  valid(cv::Rect(100, 0, 61, 101)).setTo(0);
  const RangeMap map = sweepOf(s, filling(2), nullptr, valid);
  EXPECT_EQ(cv::countNonZero(map.confidence(cv::Rect(100, 0, 61, 101))), 0);
  EXPECT_GT(cv::countNonZero(map.confidence), 10000);
}

}  // namespace
}  // namespace vcharge
