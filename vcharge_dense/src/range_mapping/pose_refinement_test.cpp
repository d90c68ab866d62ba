#include "range_mapping/pose_refinement.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"

namespace vcharge {
namespace {

RigidTransform relativePose(const Sequence& s, size_t n) {
  return s.neighbours[n].world_from_camera.inverse() * s.reference.world_from_camera;
}

double angleBetween(const RigidTransform& a, const RigidTransform& b) {
  return (a.inverse() * b).rotation().angularDistance(Eigen::Quaterniond::Identity());
}

TEST(PoseRefinementTest, RemovesMostOfTheOdometrysJitter) {
  double before = 0.0, after = 0.0;
  int count = 0, refined = 0;
  for (uint32_t draw = 0; draw < 6; ++draw) {
    const bool left = draw % 2 == 0;
    const Sequence truth = makeSequence(lotScene(30 + draw), left ? kLeft : kFront, 0.2, -4, 0, 2.0);
    Sequence s = truth;
    const PoseNoiseOptions noise;
    std::mt19937 generator(draw);
    disturb(noise, &generator, &s);
    const PoseRefinement refinement(kCamera, s.reference.pixels, allValid(), noise);
    for (size_t n = 0; n < s.neighbours.size(); ++n) {
      const auto result = refinement.refine(s.neighbours[n].pixels, relativePose(s, n));
      before += std::pow(angleBetween(relativePose(s, n), relativePose(truth, n)), 2.0);
      after += std::pow(angleBetween(result.neighbour_from_reference, relativePose(truth, n)), 2.0);
      refined += result.is_refined ? 1 : 0;
      ++count;
    }
  }
  RecordProperty("rotation_error_before_over_after", std::to_string(std::sqrt(before / after)));
  EXPECT_GE(refined, 0.8 * count);
  EXPECT_LT(std::sqrt(after), 0.5 * std::sqrt(before));
}

TEST(PoseRefinementTest, RangesOfJitteredPosesBecomeBetter) {
  constexpr int kBorder = 8;
  int right[2] = {0, 0}, all = 0;
  for (uint32_t draw = 0; draw < 4; ++draw) {
    Sequence s = makeSequence(lotScene(40 + draw), kLeft, 0.2, -4, 0, 2.0);
    PlaneSweepOptions options;
    options.min_confidence = 0.0;
    std::mt19937 generator(100 + draw);
    disturb(options.pose_noise, &generator, &s);
    all += (kSize.width - 2 * kBorder) * (kSize.height - 2 * kBorder);
    for (const bool refine : {false, true}) {
      options.refine_poses = refine;
      right[refine ? 1 : 0] += countRight(sweepOf(s, options), s.truth, 0.01, kBorder);
    }
  }
  RecordProperty("within_1_percent", std::to_string(static_cast<double>(right[0]) / all));
  RecordProperty("within_1_percent_refined", std::to_string(static_cast<double>(right[1]) / all));
  EXPECT_GT(right[1], right[0] + 0.05 * all);
}

TEST(PoseRefinementTest, KeepsTheGivenPoseWhereTheCorrectionExceedsItsNoise) {
  // A pose that is wrong by much more than its noise is returned unchanged.
  const Sequence s = makeSequence(lotScene(50), kLeft, 0.2, -2, 0, 2.0);
  PoseNoiseOptions tight;
  tight.rotation_rad = tight.rotation_rad_per_sqrt_m = 1e-4;
  tight.translation_m = tight.translation_m_per_sqrt_m = 1e-4;
  const PoseRefinement refinement(kCamera, s.reference.pixels, allValid(), tight);
  const RigidTransform right = relativePose(s, 0);
  const RigidTransform wrong(rotationFromVector({0.02, -0.01, 0.03}) * right.rotation(), right.translation());
  const auto result = refinement.refine(s.neighbours[0].pixels, wrong);
  EXPECT_FALSE(result.is_refined);
  EXPECT_EQ(angleBetween(result.neighbour_from_reference, wrong), 0.0);
  EXPECT_EQ(result.neighbour_from_reference.translation(), wrong.translation());
}

TEST(PoseRefinementTest, KeepsTheGivenPoseWithoutTracks) {
  const Sequence s = makeSequence(lotScene(51), kLeft, 0.2, -1, 0);
  const cv::Mat gray(kSize, CV_8UC1, cv::Scalar(90));
  cv::Mat noise(kSize, CV_8UC1);
  cv::RNG(7).fill(noise, cv::RNG::UNIFORM, 0, 256);
  for (const cv::Mat& pixels : {gray, noise}) {
    const PoseRefinement refinement(kCamera, s.reference.pixels, allValid(), PoseNoiseOptions());
    const auto result = refinement.refine(pixels, relativePose(s, 0));
    EXPECT_FALSE(result.is_refined);
    EXPECT_EQ(angleBetween(result.neighbour_from_reference, relativePose(s, 0)), 0.0);
  }
  EXPECT_FALSE(PoseRefinement(kCamera, gray, allValid(), PoseNoiseOptions())
                   .refine(s.neighbours[0].pixels, relativePose(s, 0))
                   .is_refined);
}

}  // namespace
}  // namespace vcharge
