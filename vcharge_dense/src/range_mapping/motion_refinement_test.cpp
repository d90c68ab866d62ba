#include "range_mapping/motion_refinement.h"

#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"

namespace vcharge {
namespace {

constexpr int kNumFrames = 5;
constexpr double kStep_m = 0.2;

/// Images of the left and the front camera of a vehicle that moves forward; frame 0 is the oldest.
struct Drive {
  std::vector<std::optional<MotionRefinement::Camera>> cameras;
  std::vector<Timestamp> stamps;
  std::vector<RigidTransform> odom_from_vehicle;
  std::vector<std::vector<cv::Mat>> images;  // per frame and camera

  explicit Drive(uint32_t seed) {
    const AnalyticScene scene = lotScene(seed);
    cameras = {MotionRefinement::Camera{kCamera, allValid(), kLeft}, std::nullopt,
               MotionRefinement::Camera{kCamera, allValid(), kFront}};
    for (int i = 0; i < kNumFrames; ++i) {
      stamps.push_back(Timestamp::fromNanoseconds(1000000000 + i * 80000000));
      const Eigen::Vector3d position_m((i + 1 - kNumFrames) * kStep_m, 0.0, 0.0);
      odom_from_vehicle.emplace_back(Eigen::Quaterniond::Identity(), position_m);
      const auto render = [&](const RigidTransform& camera) {
        return scene.render(kCamera, kSize, odom_from_vehicle.back() * camera, 2.0,
                            static_cast<uint32_t>(100 + i));
      };
      images.push_back({render(kLeft), cv::Mat(), render(kFront)});
    }
  }

  void addTo(MotionRefinement* refinement) const {
    for (size_t i = 0; i < stamps.size(); ++i) {
      refinement->addFrame(stamps[i], images[i], odom_from_vehicle[i]);
    }
  }
  /// Motion of the last frame to an earlier one.
  RigidTransform motionTo(size_t neighbour) const {
    return odom_from_vehicle[neighbour].inverse() * odom_from_vehicle.back();
  }
  MotionRefinement::Result refine(const MotionRefinement& refinement, size_t neighbour,
                                  const RigidTransform& given) const {
    return refinement.refine(stamps[neighbour], stamps.back(), given);
  }
};

RigidTransform disturbed(const RigidTransform& motion, const PoseNoiseOptions& noise,
                         std::mt19937* generator) {
  const auto randomVector = [&](double constant, double per_sqrt_m) {
    const double sigma = std::hypot(constant, per_sqrt_m * std::sqrt(motion.translation().norm()));
    Eigen::Vector3d vector;
    for (int i = 0; i < 3; ++i) {
      vector[i] = sigma * normalNumber(generator);
    }
    return vector;
  };
  return RigidTransform(
      rotationFromVector(randomVector(noise.rotation_rad, noise.rotation_rad_per_sqrt_m)) * motion.rotation(),
      motion.translation() + randomVector(noise.translation_m, noise.translation_m_per_sqrt_m));
}

double angleBetween(const RigidTransform& a, const RigidTransform& b) {
  return (a.inverse() * b).rotation().angularDistance(Eigen::Quaterniond::Identity());
}

/// Root mean square of the error across the direction of travel: only the prior knows the one along it.
double errorAcross(const RigidTransform& a, const RigidTransform& b) {
  return (a.translation() - b.translation()).tail<2>().norm();
}

TEST(MotionRefinementTest, RemovesMostOfTheOdometrysJitter) {
  double rotation_before = 0.0, rotation_after = 0.0, across_before = 0.0, across_after = 0.0;
  std::mt19937 generator(1);
  const PoseNoiseOptions noise;
  for (uint32_t draw = 0; draw < 4; ++draw) {
    const Drive drive(30 + draw);
    MotionRefinement refinement(drive.cameras, noise);
    drive.addTo(&refinement);
    for (size_t n = 0; n + 1 < kNumFrames; ++n) {
      const RigidTransform truth = drive.motionTo(n), given = disturbed(truth, noise, &generator);
      const MotionRefinement::Result result = drive.refine(refinement, n, given);
      EXPECT_TRUE(result.is_refined);
      EXPECT_LT(result.rotation_variance_left, 0.1);
      rotation_before += std::pow(angleBetween(given, truth), 2.0);
      rotation_after += std::pow(angleBetween(result.neighbour_from_reference, truth), 2.0);
      across_before += std::pow(errorAcross(given, truth), 2.0);
      across_after += std::pow(errorAcross(result.neighbour_from_reference, truth), 2.0);
    }
  }
  RecordProperty("rotation_error_before_over_after",
                 std::to_string(std::sqrt(rotation_before / rotation_after)));
  EXPECT_LT(std::sqrt(rotation_after), 0.4 * std::sqrt(rotation_before));
  EXPECT_LT(std::sqrt(across_after), 0.5 * std::sqrt(across_before));
}

TEST(MotionRefinementTest, IsTheSameOnAnyNumberOfThreads) {
  const Drive drive(35);
  std::vector<RigidTransform> motions;
  for (const size_t threads : {1U, 2U, 5U}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    MotionRefinement refinement(drive.cameras, PoseNoiseOptions());
    drive.addTo(&refinement);
    motions.push_back(drive.refine(refinement, 1, drive.motionTo(1)).neighbour_from_reference);
  }
  for (const RigidTransform& motion : motions) {
    EXPECT_EQ(motion.translation(), motions[0].translation());
    EXPECT_EQ(motion.rotation().coeffs(), motions[0].rotation().coeffs());
  }
}

TEST(MotionRefinementTest, RangesOfJitteredPosesBecomeBetter) {
  constexpr int kBorder = 8;
  int right[2] = {0, 0}, all = 0;
  std::mt19937 generator(2);
  PlaneSweepOptions options;
  options.min_confidence = 0.0;
  for (uint32_t draw = 0; draw < 3; ++draw) {
    const Drive drive(40 + draw);
    MotionRefinement refinement(drive.cameras, options.pose_noise);
    drive.addTo(&refinement);
    const PlaneSweep sweep(kCamera, allValid(), options, groundInCamera(kLeft));
    const cv::Mat truth = lotScene(40 + draw).range(kCamera, kSize, kLeft);
    std::vector<SweepImage> neighbours[2];
    for (size_t n = 0; n + 1 < kNumFrames; ++n) {
      const RigidTransform given = disturbed(drive.motionTo(n), options.pose_noise, &generator);
      const RigidTransform refined = drive.refine(refinement, n, given).neighbour_from_reference;
      neighbours[0].push_back({drive.stamps[n], drive.images[n][0], given.inverse() * kLeft});
      neighbours[1].push_back({drive.stamps[n], drive.images[n][0], refined.inverse() * kLeft});
    }
    const SweepImage reference{drive.stamps.back(), drive.images.back()[0], kLeft};
    for (const int is_refined : {0, 1}) {
      right[is_refined] += countRight(sweep.sweep(reference, neighbours[is_refined]), truth, 0.01, kBorder);
    }
    all += (kSize.width - 2 * kBorder) * (kSize.height - 2 * kBorder);
  }
  RecordProperty("within_1_percent", std::to_string(static_cast<double>(right[0]) / all));
  RecordProperty("within_1_percent_refined", std::to_string(static_cast<double>(right[1]) / all));
  EXPECT_GT(right[1], right[0] + 0.05 * all);
}

TEST(MotionRefinementTest, KeepsTheGivenMotionWhereTheCorrectionExceedsItsNoise) {
  const Drive drive(50);
  PoseNoiseOptions tight;
  tight.rotation_rad = tight.rotation_rad_per_sqrt_m = 1e-4;
  tight.translation_m = tight.translation_m_per_sqrt_m = 1e-4;
  MotionRefinement refinement(drive.cameras, tight);
  drive.addTo(&refinement);
  const RigidTransform right = drive.motionTo(2);
  const RigidTransform wrong(rotationFromVector({0.02, -0.01, 0.03}) * right.rotation(), right.translation());
  const MotionRefinement::Result result = drive.refine(refinement, 2, wrong);
  EXPECT_FALSE(result.is_refined);
  EXPECT_EQ(angleBetween(result.neighbour_from_reference, wrong), 0.0);
  EXPECT_EQ(result.neighbour_from_reference.translation(), wrong.translation());
}

TEST(MotionRefinementTest, KeepsTheGivenMotionWithoutPoints) {
  Drive drive(51);
  cv::RNG noise(7);
  for (const bool is_gray : {true, false}) {
    for (std::vector<cv::Mat>& frame : drive.images) {
      for (cv::Mat& image : frame) {
        if (!image.empty()) {
          image = cv::Mat(kSize, CV_8UC1, cv::Scalar(90));
          is_gray ? void() : noise.fill(image, cv::RNG::UNIFORM, 0, 256);
        }
      }
    }
    MotionRefinement refinement(drive.cameras, PoseNoiseOptions());
    drive.addTo(&refinement);
    EXPECT_FALSE(drive.refine(refinement, 0, drive.motionTo(0)).is_refined);
  }
}

TEST(MotionRefinementTest, ForgetsFramesAndGoesOnWithoutACamera) {
  const Drive drive(52);
  MotionRefinement refinement(drive.cameras, PoseNoiseOptions());
  drive.addTo(&refinement);
  const int both = drive.refine(refinement, 3, drive.motionTo(3)).num_points;
  refinement.forgetBefore(drive.stamps[2]);
  EXPECT_EQ(drive.refine(refinement, 1, drive.motionTo(1)).num_points, 0);
  EXPECT_EQ(drive.refine(refinement, 3, drive.motionTo(3)).num_points, both);
  refinement.clear();
  EXPECT_EQ(drive.refine(refinement, 3, drive.motionTo(3)).num_points, 0);
  for (size_t i = 0; i < drive.stamps.size(); ++i) {
    const cv::Mat left = i == 2 ? cv::Mat() : drive.images[i][0];  // late once
    refinement.addFrame(drive.stamps[i], {left, cv::Mat(), cv::Mat()}, drive.odom_from_vehicle[i]);
    refinement.forgetBefore(drive.stamps[i]);
  }
  EXPECT_EQ(drive.refine(refinement, 3, drive.motionTo(3)).num_points, 0);
}

}  // namespace
}  // namespace vcharge
