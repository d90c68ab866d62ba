// Accuracy of PlaneSweep on analytic scenes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

/// Quality of the ranges inside a border of 8 pixels.
struct Score {
  double known = 0.0;         // fraction of all pixels
  double right = 0.0;         // fraction of known pixels with a range within the tolerance
  double within_sigma = 0.0;  // fraction of known pixels with an error within one sigma
  double median_error = 0.0;  // relative
};
template <class Select>
Score judge(const RangeMap& map, const cv::Mat& truth, double relative_tolerance, const Select& select) {
  int all = 0, known = 0, right = 0, within_sigma = 0;
  std::vector<double> errors;
  for (int y = 8; y < kSize.height - 8; ++y) {
    for (int x = 8; x < kSize.width - 8; ++x) {
      const double true_range = truth.at<double>(y, x);
      if (!std::isfinite(true_range) || !select(x, y)) {
        continue;
      }
      ++all;
      const double error = map.range_m.at<float>(y, x) - true_range;
      if (std::isnan(error)) {
        continue;
      }
      ++known;
      right += std::abs(error) <= relative_tolerance * true_range ? 1 : 0;
      within_sigma += std::abs(error) <= map.standard_deviation_m.at<float>(y, x) ? 1 : 0;
      errors.push_back(std::abs(error) / true_range);
    }
  }
  Score score;
  if (known > 0) {
    std::nth_element(errors.begin(), errors.begin() + known / 2, errors.end());
    score = {static_cast<double>(known) / all, static_cast<double>(right) / known,
             static_cast<double>(within_sigma) / known, errors[static_cast<size_t>(known / 2)]};
  }
  return score;
}
const auto kEverywhere = [](int, int) { return true; };

TEST(PlaneSweepAccuracyTest, FindsFrontoParallelWallWithinOnePlaneSpacing) {
  // Optical axis along +y, wall at y = 4: every pixel lies on the plane at distance 4.
  const AnalyticScene scene({{{0, 4, 0}, {0, -1, 0}}}, 3);
  const Sequence s = makeSequence(scene, cameraPose({0, 0, 1}, 1.5707963267948966, 0.0), 0.1, -2, 2);
  SweepDetails details;
  sweepOf(s, plainOptions(), &details);
  const std::vector<float> planes =
      makePlaneFamilies(plainOptions(), std::nullopt)[0].inverse_distances_per_m;
  int right = 0, all = 0;
  for (int y = 20; y < 180; ++y) {
    for (int x = 40; x < 280; ++x) {
      const int plane = details.plane.at<int>(y, x);
      ASSERT_GE(plane, 0);
      const float error = planes[static_cast<size_t>(plane)] - 0.25f;
      right += std::abs(error) <= planes[1] - planes[0] ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GE(right, 0.99 * all);
}

TEST(PlaneSweepAccuracyTest, SubPlaneInterpolationAndRefinementImprove) {
  const Sequence s = makeSequence(lotScene(1), kLeft, 0.1, -2, 2);
  PlaneSweepOptions options = plainOptions();
  SweepDetails details;
  RangeMap map = sweepOf(s, options, &details);
  const double interpolated = judge(map, s.truth, 0.05, kEverywhere).median_error;
  options.num_refinement_steps = 16;
  const double refined = judge(sweepOf(s, options), s.truth, 0.05, kEverywhere).median_error;
  // Moves each range to the plane that was found.
  const PlaneFamily family = makePlaneFamilies(options, std::nullopt).front();
  const RayTable rays(kCamera, kSize, 6.283185307179586);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const int plane = details.plane.at<int>(y, x);
      if (!std::isnan(map.range_m.at<float>(y, x))) {
        const double weight = -family.normal.dot(rays.ray(x, y).cast<double>());
        const double inverse_distance = family.inverse_distances_per_m[static_cast<size_t>(plane)];
        map.range_m.at<float>(y, x) = static_cast<float>(1.0 / (weight * inverse_distance));
      }
    }
  }
  const double planes_only = judge(map, s.truth, 0.05, kEverywhere).median_error;
  EXPECT_LT(interpolated, 0.5 * planes_only);
  EXPECT_LT(refined, interpolated);
}

TEST(PlaneSweepAccuracyTest, GroundParallelPlanesImproveTheGround) {
  const AnalyticScene ground_only({{{0, 0, 0}, {0, 0, 1}}}, 5);
  const Sequence s = makeSequence(ground_only, kLeft, 0.2, -4, 0);
  PlaneSweepOptions options = plainOptions();
  const auto near = [&](int x, int y) { return s.truth.at<double>(y, x) < 4.0; };
  const Score fronto = judge(sweepOf(s, options), s.truth, 0.02, near);
  options.num_ground_planes = PlaneSweepOptions().num_ground_planes;
  const Score both = judge(sweepOf(s, options), s.truth, 0.02, near);
  EXPECT_GT(both.known * both.right, 0.97);
  EXPECT_LT(both.median_error, fronto.median_error);
}

TEST(PlaneSweepAccuracyTest, DirectionOfTravelIsUncertainOrUnobserved) {
  const AnalyticScene wall({{{10, 0, 0}, {-1, 0, 0}}}, 4);
  const Sequence s = makeSequence(wall, cameraPose({0, 0, 1}, 0.0, 0.0), 0.2, -4, 0, 1.0);
  PlaneSweepOptions options = plainOptions();
  options.num_refinement_steps = 16;
  const RangeMap map = sweepOf(s, options);
  int known_at_epipole = 0;
  double sigma_near = 0.0, sigma_far = 0.0;
  int near = 0, far = 0;
  for (int y = 10; y < 190; ++y) {
    for (int x = 10; x < 310; ++x) {
      const double distance = std::hypot(x - kCamera.u0(), y - kCamera.v0());
      const double relative = map.standard_deviation_m.at<float>(y, x) / map.range_m.at<float>(y, x);
      const double sigma = relative <= 0.2 ? relative : std::nan("");
      known_at_epipole += distance < 3.0 && !std::isnan(sigma) ? 1 : 0;
      if (distance > 15 && distance < 30 && !std::isnan(sigma)) {
        sigma_near += sigma;
        ++near;
      }
      if (distance > 60 && distance < 90 && !std::isnan(sigma)) {
        sigma_far += sigma;
        ++far;
      }
    }
  }
  EXPECT_EQ(known_at_epipole, 0);
  ASSERT_GT(far, 1000);
  EXPECT_TRUE(near == 0 || sigma_near / near > 2.0 * sigma_far / far);
}

TEST(PlaneSweepAccuracyTest, OcclusionHandlingHelpsBehindAnOccluder) {
  // A narrow board in front of a wall hides the wall beside it from some images.
  const AnalyticScene scene({{{0, 5, 1}, {0, -1, 0}}, {{0, 1.5, 1}, {0, -1, 0}, {0.25, 0.0, 3.0}}}, 6);
  const Sequence s = makeSequence(scene, cameraPose({0, 0, 1}, 1.5707963267948966, 0.0), 0.2, -2, 2);
  const auto besideBoard = [&](int x, int y) {
    const bool wall = s.truth.at<double>(y, x) > 3.0;
    return wall && std::abs(x - 162) < 45 && y > 40 && y < 160;
  };
  PlaneSweepOptions options = plainOptions();
  const auto rightFraction = [&](Aggregation aggregation) {
    options.aggregation = aggregation;
    options.min_confidence = 0.0;
    const RangeMap map = sweepOf(s, options);
    const Score score = judge(map, s.truth, 0.1, besideBoard);
    return score.known * score.right;
  };
  const double mean = rightFraction(Aggregation::kMean);
  EXPECT_GT(rightFraction(Aggregation::kReferenceSplit), mean);
}

TEST(PlaneSweepAccuracyTest, StandardDeviationMatchesErrorsUnderPixelAndPoseNoise) {
  // Averages over several scenes, views and random odometry errors.
  double within_sigma = 0.0, known = 0.0;
  for (uint32_t draw = 1; draw <= 12; ++draw) {
    const bool left = draw % 2 == 0;
    Sequence s = makeSequence(lotScene(10 + draw), left ? kLeft : kFront, left ? 0.2 : 0.5, -4, 0, 2.0);
    const PlaneSweepOptions options;
    std::mt19937 generator(draw);
    disturb(options.pose_noise, &generator, &s);
    const RangeMap map = sweepOf(s, options);
    const Score score = judge(map, s.truth, 0.05, kEverywhere);
    within_sigma += score.within_sigma * score.known;
    known += score.known;
  }
  RecordProperty("within_one_sigma", std::to_string(within_sigma / known));
  EXPECT_GE(within_sigma / known, 0.60);
  EXPECT_LE(within_sigma / known, 0.76);
}

TEST(PlaneSweepAccuracyTest, MostConfidentPixelsAreRight) {
  // True ranges of 0.5 to 20 m, at least 20 degrees from the direction of travel, with and without odometry
  // errors.
  const RayTable rays(kCamera, kSize, 6.283185307179586);
  for (const bool left : {true, false}) {
    for (const bool true_poses : {true, false}) {
      const RigidTransform start = left ? kLeft : kFront;
      Sequence s = makeSequence(lotScene(20), start, left ? 0.2 : 0.5, -4, 0, 2.0);
      const PlaneSweepOptions options;
      std::mt19937 generator(3);
      if (!true_poses) {
        disturb(options.pose_noise, &generator, &s);
      }
      const RangeMap map = sweepOf(s, options);
      std::vector<std::pair<float, bool>> pixels;  // negated confidence, and whether the range is right
      for (int y = 0; y < kSize.height; ++y) {
        for (int x = 0; x < kSize.width; ++x) {
          const double truth = s.truth.at<double>(y, x);
          const Eigen::Vector3d direction = start.rotation() * rays.ray(x, y).cast<double>();
          if (truth >= 0.5 && truth <= 20.0 && std::abs(direction.x()) < std::cos(0.349)) {
            const bool right = std::abs(map.range_m.at<float>(y, x) - truth) <= 0.05 * truth;
            pixels.emplace_back(-map.confidence.at<float>(y, x), right);
          }
        }
      }
      std::stable_sort(pixels.begin(), pixels.end(),
                       [](const auto& a, const auto& b) { return a.first < b.first; });
      for (const double density : {0.4, 0.6, 0.8}) {
        const auto count = static_cast<size_t>(density * static_cast<double>(pixels.size()));
        const auto right = std::count_if(pixels.begin(), pixels.begin() + static_cast<std::ptrdiff_t>(count),
                                         [](const auto& pixel) { return pixel.second; });
        const double fraction = static_cast<double>(right) / static_cast<double>(count);
        std::printf("%s, %s poses, %.0f %% density: %.4f within 5 %%\n", left ? "left" : "front",
                    true_poses ? "true" : "odometry's", 100.0 * density, fraction);
        if (density <= 0.6) {
          EXPECT_GE(fraction, 0.90);
        }
      }
    }
  }
}

}  // namespace
}  // namespace vcharge
