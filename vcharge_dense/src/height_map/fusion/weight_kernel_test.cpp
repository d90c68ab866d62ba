#include "height_map/fusion/weight_kernel.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "height_map/plain_height_map.h"
#include "height_map/test_views.h"

namespace vcharge {
namespace {

constexpr float kScale = 1.0F / (1.0F + 0.16F);  // weight of a range with a sigma of 0.02 m

/// Weighting by standard deviation alone: ranges of blankView() have a confidence of 1.
RangeWeighting weightingBySigma() {
  RangeWeighting weighting;
  weighting.reference_footprint_m = 1e9;
  weighting.reference_confidence = 0.99;
  return weighting;
}

WeightProfile profileWithRamp() {
  WeightProfile profile{HeightFusionOptions()};
  profile.min_ramp_m = 0.02F;
  return profile;
}

/// Weights every 5 cm along the optical axis in front of and behind a wall at 2 m.
std::vector<float> alongAxis(float sigma_m) {
  RangeMap map = testing::blankView(cv::Size(64, 48));
  for (int y = 0; y < map.range_m.rows; ++y) {
    for (int x = 0; x < map.range_m.cols; ++x) {
      map.range_m.at<float>(y, x) = static_cast<float>(2.0 / testing::rayOf(map, x, y).z());
    }
  }
  map.standard_deviation_m.setTo(sigma_m);
  const PackedRangeMap packed = packRangeMap(map, RigidTransform(), weightingBySigma());
  std::vector<float> weights(64, 0.0F);
  addColumnWeightsKernel()(packed, profileWithRamp(), {{0, 0, 0.525F}, {0, 0, 0.05F}, 64}, weights.data());
  return weights;
}

TEST(WeightKernelTest, IsFreeInFrontOccupiedInABandBehindAndNothingBeyond) {
  const std::vector<float> weights = alongAxis(0.02F);
  for (int z = 0; z < 64; ++z) {
    const double behind = 0.525 + 0.05 * z - 2.0;
    if (behind < -0.021) {
      EXPECT_NEAR(weights[z], -kScale, 1e-3) << behind;
    } else if (behind > 0.021 && behind < 0.169) {
      EXPECT_NEAR(weights[z], kScale, 1e-3) << behind;
    } else if (behind > 0.171) {
      EXPECT_EQ(weights[z], 0.0F) << behind;
    }
  }
}

TEST(WeightKernelTest, CountsUncertainRangesLess) {
  EXPECT_NEAR(alongAxis(0.05F)[0], -0.5, 1e-3);
  EXPECT_NEAR(alongAxis(0.1F)[0], -0.2, 1e-3);
}

TEST(WeightKernelTest, CountsRangesByTheLogOddsOfTheirConfidence) {
  RangeWeighting weighting = weightingBySigma();
  weighting.reference_confidence = 0.9;
  const auto weightAt = [&](double confidence) {
    RangeMap map = testing::blankView(cv::Size(64, 48));
    map.confidence.setTo(confidence);
    return packRangeMap(map, RigidTransform(), weighting).values[4];
  };
  EXPECT_NEAR(weightAt(0.9), kScale, 1e-5);
  EXPECT_NEAR(weightAt(0.5), 0.0, 1e-5);
  EXPECT_NEAR(weightAt(0.99) / kScale, std::log(99.0) / std::log(9.0), 1e-3);
  EXPECT_EQ(weightAt(1.0), weightAt(0.99));  // finite
}

TEST(WeightKernelTest, CountsAViewByItsWeight) {
  const RangeMap map = testing::blankView(cv::Size(64, 48));
  RangeWeighting weighting = weightingBySigma();
  const float once = packRangeMap(map, RigidTransform(), weighting).values[4];
  weighting.view_weight = 3.0;
  EXPECT_NEAR(packRangeMap(map, RigidTransform(), weighting).values[4], 3.0F * once, 1e-5);
}

TEST(WeightKernelTest, CountsRangesLessWhosePixelSpansMoreOfTheSurface) {
  // Level ground 1 m below a camera that faces the horizon: in the middle column a pixel at range r spans
  // r * r / 1 m of ground per radian.
  RangeMap map = testing::blankView(cv::Size(640, 400));
  for (int y = 0; y < map.range_m.rows; ++y) {
    for (int x = 0; x < map.range_m.cols; ++x) {
      const double down = testing::rayOf(map, x, y).y();
      map.range_m.at<float>(y, x) = down > 0.05 ? static_cast<float>(1.0 / down) : std::nanf("");
    }
  }
  RangeWeighting weighting = weightingBySigma();
  const PackedRangeMap without = packRangeMap(map, RigidTransform(), weighting);
  weighting.reference_footprint_m = 0.05;
  const PackedRangeMap with = packRangeMap(map, RigidTransform(), weighting);
  const double pixel_rad = 2.1 / 320.0;
  int num = 0;
  for (int y = 210; y < 300; y += 10) {
    const size_t at = (static_cast<size_t>(y) * 640 + 320) * PackedRangeMap::kValues;
    const double range = map.range_m.at<float>(y, 320);
    if (!(range > 2.0)) {
      continue;  // closer ground is imaged far from the middle, where pixels are wider
    }
    const double relative = range * range * pixel_rad / weighting.reference_footprint_m;
    EXPECT_NEAR(with.values[at + 4] / without.values[at + 4], 1.0 / (1.0 + relative * relative),
                0.2 / (1.0 + relative * relative))
        << range;
    ++num;
  }
  EXPECT_GT(num, 3);
}

TEST(WeightKernelTest, EqualsThePlainReference) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  RangeMap map = testing::blankView(cv::Size(120, 90));
  for (int y = 0; y < map.range_m.rows; ++y) {
    for (int x = 0; x < map.range_m.cols; ++x) {
      map.range_m.at<float>(y, x) = uniform(random) < 0.2F ? std::nanf("") : 1.0F + 5.0F * uniform(random);
      map.standard_deviation_m.at<float>(y, x) = 0.3F * uniform(random);
    }
  }
  RangeWeighting weighting = weightingBySigma();
  weighting.reference_footprint_m = 0.1;
  const PackedRangeMap packed = packRangeMap(map, RigidTransform(), weighting);
  const WeightProfile profile = profileWithRamp();
  size_t num_different = 0, num_touched = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto spread = [&](float width) { return width * (2.0F * uniform(random) - 1.0F); };
    const VoxelColumn column{
        {spread(4.0F), spread(4.0F), spread(6.0F)}, {spread(0.02F), spread(0.05F), spread(0.02F)}, 96};
    std::vector<float> fast(96, 0.5F), plain(96, 0.5F);
    addColumnWeightsKernel()(packed, profile, column, fast.data());
    addColumnWeightsPlain(packed, profile, column, plain.data());
    for (int z = 0; z < 96; ++z) {
      num_touched += plain[z] != 0.5F ? 1 : 0;
      num_different += std::abs(fast[z] - plain[z]) > 1e-3F ? 1 : 0;
    }
  }
  EXPECT_GT(num_touched, 20000U);
  // Rounding may shift the border of a pixel and the end of the band.
  EXPECT_LE(num_different, num_touched / 1000);
}

TEST(WeightKernelTest, LeavesOutUnknownAndUncertainRanges) {
  for (const float range : {std::nanf(""), std::numeric_limits<float>::infinity(), -1.0F, 0.0F}) {
    RangeMap map = testing::blankView(cv::Size(64, 48));
    map.range_m.setTo(range);
    EXPECT_EQ(packRangeMap(map, RigidTransform()).num_known, 0U) << range;
  }
  RangeMap map = testing::blankView(cv::Size(64, 48));
  map.confidence.setTo(0.1F);
  EXPECT_EQ(packRangeMap(map, RigidTransform()).num_known, 0U);
  map = testing::blankView(cv::Size(64, 48));
  map.standard_deviation_m.setTo(std::nanf(""));
  EXPECT_EQ(packRangeMap(map, RigidTransform()).num_known, 0U);
}

}  // namespace
}  // namespace vcharge
