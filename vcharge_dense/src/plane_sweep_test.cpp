#include "vcharge_dense/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "analytic_scene.h"
#include "plain_plane_sweep.h"
#include "vcharge_core/content_hash.h"

namespace vcharge {
namespace {

const cv::Size kSize(320, 200);
const MeiCamera kCamera(1.158, 224.0, 223.5, 162.0, 99.5);

/// A camera at the given place (vehicle axes: x forward, y left, z up) that looks along an azimuth, tilted
/// downwards.
RigidTransform cameraPose(const Eigen::Vector3d& position, double azimuth_rad, double down_rad) {
  const Eigen::Quaterniond vehicle_from_optical(0.5, -0.5, 0.5, -0.5);  // z forward, x right, y down
  return RigidTransform(rotationFromYawPitchRoll(azimuth_rad, down_rad, 0.0) * vehicle_from_optical,
                        position);
}

struct Sequence {
  SweepImage reference;
  std::vector<SweepImage> neighbours;
  cv::Mat truth;  // range, CV_64FC1
  Plane ground;
};

/// Images every `step_m` along x, numbered from `first` to `last`; number 0 is the reference.
Sequence makeSequence(const AnalyticScene& scene, const RigidTransform& start, double step_m, int first,
                      int last, double noise = 0.0) {
  Sequence sequence;
  for (int i = first; i <= last; ++i) {
    const RigidTransform pose(start.rotation(), start.translation() + Eigen::Vector3d(i * step_m, 0.0, 0.0));
    SweepImage image{Timestamp::fromNanoseconds(1000000000 + i * 80000000),
                     scene.render(kCamera, kSize, pose, noise, static_cast<uint32_t>(100 + i)), pose};
    if (i == 0) {
      sequence.reference = image;
    } else {
      sequence.neighbours.push_back(image);
    }
  }
  sequence.truth = scene.range(kCamera, kSize, start);
  sequence.ground = groundInCamera(start);
  return sequence;
}

/// Moves the neighbours, which come in order of time, as odometry errs: its scale is off for the whole
/// sequence, its pose walks at random from image to image, and the reference's own jitter is common to all
/// pairs.
void disturb(const PoseNoiseOptions& noise, std::mt19937* generator, Sequence* sequence) {
  const auto randomVector = [&](double sigma) {
    Eigen::Vector3d vector;
    for (int i = 0; i < 3; ++i) {
      vector[i] = sigma * normalNumber(generator);
    }
    return vector;
  };
  const double scale = noise.scale * normalNumber(generator);
  const Eigen::Vector3d jitter_m = randomVector(noise.translation_m);
  const Eigen::Vector3d jitter_rad = randomVector(noise.rotation_rad);
  const Eigen::Vector3d origin = sequence->reference.world_from_camera.translation();
  const auto walk = [&](auto begin, auto end, const auto isOnThisSide) {
    Eigen::Vector3d walked_m = jitter_m, walked_rad = jitter_rad, last = origin;
    for (auto image = begin; image != end; ++image) {
      if (!isOnThisSide(*image)) {
        continue;
      }
      const RigidTransform pose = image->world_from_camera;
      const double root_m = std::sqrt((pose.translation() - last).norm());
      last = pose.translation();
      walked_m += randomVector(noise.translation_m_per_sqrt_m * root_m);
      walked_rad += randomVector(noise.rotation_rad_per_sqrt_m * root_m);
      image->world_from_camera =
          RigidTransform(rotationFromVector(walked_rad) * pose.rotation(),
                         pose.translation() + scale * (pose.translation() - origin) + walked_m);
    }
  };
  const Timestamp now = sequence->reference.stamp;
  auto& images = sequence->neighbours;
  walk(images.rbegin(), images.rend(), [&](const SweepImage& image) { return image.stamp < now; });
  walk(images.begin(), images.end(), [&](const SweepImage& image) { return image.stamp > now; });
}

cv::Mat allValid() {
  return cv::Mat(kSize, CV_8UC1, cv::Scalar(255));
}

PlaneSweepOptions plainOptions() {
  PlaneSweepOptions options;
  options.families = PlaneFamilies::kFrontoParallel;
  options.num_refinement_steps = 0;
  return options;
}

/// Shares of pixels inside the image's border.
struct Score {
  double known = 0.0;         // of all
  double right = 0.0;         // of the known: inverse range within the tolerance
  double honest = 0.0;        // of the known: within one sigma
  double median_error = 0.0;  // relative
};
template <class Select>
Score judge(const RangeMap& map, const cv::Mat& truth, double relative_tolerance, const Select& select) {
  int all = 0, known = 0, right = 0, honest = 0;
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
      honest += std::abs(error) <= map.standard_deviation_m.at<float>(y, x) ? 1 : 0;
      errors.push_back(std::abs(error) / true_range);
    }
  }
  Score score;
  if (known > 0) {
    std::nth_element(errors.begin(), errors.begin() + known / 2, errors.end());
    score = {static_cast<double>(known) / all, static_cast<double>(right) / known,
             static_cast<double>(honest) / known, errors[static_cast<size_t>(known / 2)]};
  }
  return score;
}
const auto kEverywhere = [](int, int) { return true; };

AnalyticScene lotScene(uint32_t seed) {
  return AnalyticScene({{{0, 0, 0}, {0, 0, 1}},
                        {{0, 6.5, 0}, {0, -1, 0}},
                        {{12.0, 0, 0}, {-1, 0, 0}},
                        {{1.5, 3.5, 0.6}, {0, -1, 0}, {1.0, 0.0, 0.6}}},
                       seed);
}

const RigidTransform kLeft = cameraPose({0.0, 1.0, 0.9}, 1.5, 0.6);
const RigidTransform kFront = cameraPose({3.6, 0.0, 0.7}, 0.0, 0.2);

TEST(PlaneSweepTest, FindsFrontoParallelWallWithinOnePlaneSpacing) {
  // Optical axis along +y, wall at y = 4: every pixel lies on the plane at distance 4.
  const AnalyticScene scene({{{0, 4, 0}, {0, -1, 0}}}, 3);
  const Sequence s = makeSequence(scene, cameraPose({0, 0, 1}, 1.5707963267948966, 0.0), 0.1, -2, 2);
  PlaneSweepOptions options = plainOptions();
  options.sub_plane_interpolation = false;
  const PlaneSweep sweep(kCamera, allValid(), options);
  SweepDetails details;
  sweep.sweep(s.reference, s.neighbours, &details);
  const PlaneFamily& family = sweep.families()[0];
  int right = 0, all = 0;
  for (int y = 20; y < 180; ++y) {
    for (int x = 40; x < 280; ++x) {
      const int plane = details.plane.at<int>(y, x);
      ASSERT_GE(plane, 0);
      const float error = family.inverse_distances_per_m[static_cast<size_t>(plane)] - 0.25f;
      right += std::abs(error) <= family.step_per_m() ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GE(right, 0.99 * all);
}

TEST(PlaneSweepTest, SubPlaneInterpolationAndRefinementImprove) {
  const Sequence s = makeSequence(lotScene(1), kLeft, 0.1, -2, 2);
  PlaneSweepOptions options = plainOptions();
  options.sub_plane_interpolation = false;
  const auto medianError = [&] {
    return judge(PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours), s.truth,
                 0.05, kEverywhere)
        .median_error;
  };
  const double planes_only = medianError();
  options.sub_plane_interpolation = true;
  const double interpolated = medianError();
  options.num_refinement_steps = 16;
  const double refined = medianError();
  EXPECT_LT(interpolated, 0.5 * planes_only);
  EXPECT_LT(refined, interpolated);
}

TEST(PlaneSweepTest, GroundParallelPlanesImproveTheGround) {
  const AnalyticScene ground_only({{{0, 0, 0}, {0, 0, 1}}}, 5);
  const Sequence s = makeSequence(ground_only, kLeft, 0.2, -4, 0);
  PlaneSweepOptions options = plainOptions();
  const auto near = [&](int x, int y) { return s.truth.at<double>(y, x) < 4.0; };
  const Score fronto =
      judge(PlaneSweep(kCamera, allValid(), options).sweep(s.reference, s.neighbours), s.truth, 0.02, near);
  options.families = PlaneFamilies::kBoth;
  const Score both =
      judge(PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours), s.truth,
            0.02, near);
  EXPECT_GT(both.known * both.right, 0.97);
  EXPECT_LT(both.median_error, fronto.median_error);
}

TEST(PlaneSweepTest, EqualsThePlainReference) {
  for (const Aggregation aggregation :
       {Aggregation::kMean, Aggregation::kReferenceSplit, Aggregation::kBestK}) {
    const Sequence s = makeSequence(lotScene(2), kLeft, 0.15, -2, 2, 1.0);
    PlaneSweepOptions options;
    options.num_refinement_steps = 0;
    options.num_planes = 32;
    options.num_ground_planes = 8;
    options.aggregation = aggregation;
    options.gate = false;
    cv::Mat mask = allValid();
    mask(cv::Rect(100, 150, 60, 50)).setTo(0);
    const PlaneSweep sweep(kCamera, mask, options, s.ground);
    SweepDetails details;
    const RangeMap map = sweep.sweep(s.reference, s.neighbours, &details);
    const PlainResult plain = plainPlaneSweep(kCamera, mask, sweep.families(), options, s.reference,
                                              s.neighbours, PlainBorder::kUnknown);
    int same_plane = 0, same_range = 0;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        if (details.plane.at<int>(y, x) == plain.plane.at<int>(y, x)) {
          ++same_plane;
          const double expected = 1.0 / plain.inverse_range.at<double>(y, x);
          const double range = map.range_m.at<float>(y, x);
          const bool both_unknown = std::isnan(range) && !(plain.inverse_range.at<double>(y, x) > 0.0);
          same_range += both_unknown || std::abs(range - expected) <= 1e-4 * expected ? 1 : 0;
        }
      }
    }
    EXPECT_GE(same_plane, 0.999 * kSize.area()) << "aggregation " << static_cast<int>(aggregation);
    EXPECT_GE(same_range, 0.999 * same_plane);
  }
}

TEST(PlaneSweepTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0);
  const PlaneSweep sweep(kCamera, allValid(), PlaneSweepOptions(), s.ground);
  std::vector<std::string> hashes;
  for (const size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    ContentHasher hasher;
    addToHash(sweep.sweep(s.reference, s.neighbours), &hasher);
    hashes.push_back(hasher.hex());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(PlaneSweepTest, MaskedPixelsAreUnknownAndDoNotVote) {
  const Sequence s = makeSequence(lotScene(1), kLeft, 0.2, -4, 0);
  cv::Mat mask = allValid();
  const cv::Rect hole(140, 90, 40, 30);
  mask(hole).setTo(0);
  Sequence painted = s;  // what is under the mask must not matter
  for (SweepImage& image : painted.neighbours) {
    image.pixels(hole).setTo(255);
  }
  painted.reference.pixels(hole).setTo(0);
  const PlaneSweep sweep(kCamera, mask, PlaneSweepOptions(), s.ground);
  const RangeMap map = sweep.sweep(s.reference, s.neighbours);
  ContentHasher plain_hash, painted_hash;
  addToHash(map, &plain_hash);
  addToHash(sweep.sweep(painted.reference, painted.neighbours), &painted_hash);
  EXPECT_EQ(plain_hash.hex(), painted_hash.hex());
  const cv::Rect touched(hole.x - 3, hole.y - 3, hole.width + 6, hole.height + 6);
  EXPECT_EQ(cv::countNonZero(map.range_m(touched) == map.range_m(touched)), 0);
  EXPECT_GT(cv::countNonZero(map.range_m == map.range_m), 0.8 * (kSize.area() - touched.area()));
}

TEST(PlaneSweepTest, PixelsWithoutTextureAreUnknown) {
  const AnalyticScene bare({{{0, 0, 0}, {0, 0, 1}, Eigen::Vector3d::Constant(1e6), 0.0}}, 1);
  const Sequence s = makeSequence(bare, kLeft, 0.2, -4, 0, 1.0);
  const RangeMap map =
      PlaneSweep(kCamera, allValid(), PlaneSweepOptions(), s.ground).sweep(s.reference, s.neighbours);
  EXPECT_LE(cv::countNonZero(map.range_m == map.range_m), 0.001 * kSize.area());
}

TEST(PlaneSweepTest, DirectionOfTravelIsUncertainOrUnobserved) {
  const AnalyticScene wall({{{10, 0, 0}, {-1, 0, 0}}}, 4);
  const Sequence s = makeSequence(wall, cameraPose({0, 0, 1}, 0.0, 0.0), 0.2, -4, 0, 1.0);
  PlaneSweepOptions options = plainOptions();
  options.num_refinement_steps = 16;
  options.max_relative_sigma = 0.2;
  const RangeMap map = PlaneSweep(kCamera, allValid(), options).sweep(s.reference, s.neighbours);
  int known_at_epipole = 0;
  double sigma_near = 0.0, sigma_far = 0.0;
  int near = 0, far = 0;
  for (int y = 10; y < 190; ++y) {
    for (int x = 10; x < 310; ++x) {
      const double distance = std::hypot(x - kCamera.u0(), y - kCamera.v0());
      const double sigma = map.standard_deviation_m.at<float>(y, x) / map.range_m.at<float>(y, x);
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

TEST(PlaneSweepTest, OcclusionHandlingHelpsBehindAnOccluder) {
  // A narrow board before a wall: beside it some images do not see the wall.
  const AnalyticScene scene({{{0, 5, 1}, {0, -1, 0}}, {{0, 1.5, 1}, {0, -1, 0}, {0.25, 0.0, 3.0}}}, 6);
  const Sequence s = makeSequence(scene, cameraPose({0, 0, 1}, 1.5707963267948966, 0.0), 0.2, -2, 2);
  const auto besideBoard = [&](int x, int y) {
    const bool wall = s.truth.at<double>(y, x) > 3.0;
    return wall && std::abs(x - 162) < 45 && y > 40 && y < 160;
  };
  PlaneSweepOptions options = plainOptions();
  const auto rightShare = [&](Aggregation aggregation) {
    options.aggregation = aggregation;
    options.gate = false;
    const RangeMap map = PlaneSweep(kCamera, allValid(), options).sweep(s.reference, s.neighbours);
    const Score score = judge(map, s.truth, 0.1, besideBoard);
    return score.known * score.right;
  };
  const double mean = rightShare(Aggregation::kMean);
  EXPECT_GT(rightShare(Aggregation::kReferenceSplit), mean);
  EXPECT_GT(rightShare(Aggregation::kBestK), mean);
}

TEST(PlaneSweepTest, NoNeighbourLeavesEverythingUnknown) {
  const Sequence s = makeSequence(lotScene(1), kLeft, 0.2, 0, 0);
  const RangeMap map = PlaneSweep(kCamera, allValid(), PlaneSweepOptions(), s.ground).sweep(s.reference, {});
  EXPECT_EQ(map.range_m.size(), kSize);
  EXPECT_EQ(cv::countNonZero(map.range_m == map.range_m), 0);
  EXPECT_EQ(cv::countNonZero(map.confidence), 0);
}

TEST(PlaneSweepTest, RejectsBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(nan, 0, 0)), std::logic_error);
  PlaneSweepOptions options;
  EXPECT_THROW(PlaneSweep(kCamera, allValid(), options), std::invalid_argument);  // no ground
  options.window_px = 4;
  EXPECT_THROW(PlaneSweep(kCamera, allValid(), options, groundInCamera(kLeft)), std::invalid_argument);
  const PlaneSweep sweep(kCamera, allValid(), plainOptions());
  SweepImage small{Timestamp(), cv::Mat(10, 10, CV_8UC1, cv::Scalar(0)), RigidTransform()};
  EXPECT_THROW(sweep.sweep(small, {}), std::logic_error);
}

TEST(PlaneSweepTest, StandardDeviationIsHonestUnderPixelAndPoseNoise) {
  // Pooled over scenes, views and draws of the odometry's errors.
  double honest = 0.0, known = 0.0;
  for (uint32_t draw = 1; draw <= 12; ++draw) {
    const bool left = draw % 2 == 0;
    Sequence s = makeSequence(lotScene(10 + draw), left ? kLeft : kFront, left ? 0.2 : 0.5, -4, 0, 2.0);
    const PlaneSweepOptions options;
    std::mt19937 generator(draw);
    disturb(options.pose_noise, &generator, &s);
    const RangeMap map = PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours);
    const Score score = judge(map, s.truth, 0.05, kEverywhere);
    honest += score.honest * score.known;
    known += score.known;
  }
  RecordProperty("within_one_sigma", std::to_string(honest / known));
  EXPECT_GE(honest / known, 0.60);
  EXPECT_LE(honest / known, 0.76);
}

TEST(PlaneSweepTest, MostConfidentPixelsAreRight) {
  // Truth 0.5 to 20 m, at least 20 degrees from the direction of travel; with true poses and with odometry's
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
      const RangeMap map =
          PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours);
      std::vector<std::pair<float, bool>> pixels;  // negative confidence, right
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
        const double share = static_cast<double>(right) / static_cast<double>(count);
        std::printf("%s, %s poses, %.0f %% density: %.4f within 5 %%\n", left ? "left" : "front",
                    true_poses ? "true" : "odometry's", 100.0 * density, share);
        if (density <= 0.6) {
          EXPECT_GE(share, 0.90);
        }
      }
    }
  }
}

}  // namespace
}  // namespace vcharge
