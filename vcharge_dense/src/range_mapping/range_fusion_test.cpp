#include "range_mapping/range_fusion.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A map of three pixels in a row around the optical axis.
RangeMap mapOf(const std::vector<float>& range_m, const std::vector<float>& sigma_m) {
  const cv::Size size(static_cast<int>(range_m.size()), 1);
  RangeMap map{Timestamp(),
               "",
               "",
               MeiCamera(0.0, 100.0, 100.0, 1.0, 0.0),
               cv::Mat(size, CV_32FC1),
               cv::Mat(size, CV_32FC1),
               cv::Mat(size, CV_32FC1),
               {}};
  for (size_t i = 0; i < range_m.size(); ++i) {
    const auto x = static_cast<int>(i);
    map.range_m.at<float>(0, x) = range_m[i];
    map.standard_deviation_m.at<float>(0, x) = sigma_m[i];
    map.confidence.at<float>(0, x) = std::isnan(range_m[i]) ? 0.0f : 0.6f;
  }
  return map;
}

TEST(RangeFusionTest, WeighsInverseRangesByTheirVariances) {
  // Inverse ranges 0.50 +- 0.01 and 0.52 +- 0.02.
  const RangeMap a = mapOf({2.0f}, {0.01f * 4.0f});
  const RangeMap b = mapOf({1.0f / 0.52f}, {0.02f / 0.2704f});
  for (const RangeMap& fused : {fuseRangeMaps(a, b), fuseRangeMaps(b, a)}) {
    const float range = fused.range_m.at<float>(0, 0);
    EXPECT_NEAR(1.0f / range, 0.504f, 1e-5f);
    EXPECT_NEAR(fused.standard_deviation_m.at<float>(0, 0) / (range * range), std::sqrt(0.8f) * 0.01f, 1e-5f);
    EXPECT_NEAR(fused.confidence.at<float>(0, 0), 0.84f, 1e-5f);
  }
}

TEST(RangeFusionTest, ContradictionsAreUnknownAndSingleRangesAreKept) {
  const RangeMap a = mapOf({2.0f, 3.0f, kNaN, kNaN}, {0.02f, 0.1f, kNaN, kNaN});
  const RangeMap b = mapOf({2.5f, kNaN, 4.0f, kNaN}, {0.02f, kNaN, 0.2f, kNaN});
  const RangeMap fused = fuseRangeMaps(a, b);
  EXPECT_TRUE(std::isnan(fused.range_m.at<float>(0, 0)));
  EXPECT_TRUE(std::isnan(fused.standard_deviation_m.at<float>(0, 0)));
  EXPECT_EQ(fused.confidence.at<float>(0, 0), 0.0f);
  EXPECT_FLOAT_EQ(fused.range_m.at<float>(0, 1), 3.0f);
  EXPECT_FLOAT_EQ(fused.range_m.at<float>(0, 2), 4.0f);
  EXPECT_FLOAT_EQ(fused.standard_deviation_m.at<float>(0, 2), 0.2f);
  EXPECT_FLOAT_EQ(fused.confidence.at<float>(0, 2), 0.6f);
  EXPECT_TRUE(std::isnan(fused.range_m.at<float>(0, 3)));
  EXPECT_FLOAT_EQ(a.range_m.at<float>(0, 0), 2.0f);  // the inputs are not changed
  EXPECT_THROW(fuseRangeMaps(a, mapOf({1.0f}, {0.1f})), std::logic_error);
}

TEST(RangeFusionTest, OnlyRangesThatTheOtherCameraConfirmsRemain) {
  // The other camera is 1 m to the left and looks in the same direction, at a wall 10 m ahead: its points
  // move by 10 pixels.
  const RigidTransform other_from_camera(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.0, 0.0, 0.0));
  const RangeMap map = mapOf({10.0f, 10.0f, 10.0f}, {0.1f, 0.1f, 0.1f});
  std::vector<float> there(20, kNaN);
  there[10] = 10.0f;  // seen by pixel 0
  there[11] = 5.0f;   // by pixel 1: something else
  const RangeMap other = mapOf(there, there);
  const RangeMap confirmed = confirmedRanges(map, other, other_from_camera, 0.005);
  EXPECT_FLOAT_EQ(confirmed.range_m.at<float>(0, 0), 10.0f);
  EXPECT_TRUE(std::isnan(confirmed.range_m.at<float>(0, 1)));
  EXPECT_TRUE(std::isnan(confirmed.range_m.at<float>(0, 2)));  // unknown there
  EXPECT_EQ(confirmed.confidence.at<float>(0, 2), 0.0f);
}

}  // namespace
}  // namespace vcharge
