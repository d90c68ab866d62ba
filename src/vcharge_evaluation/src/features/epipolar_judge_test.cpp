#include "features/epipolar_judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {
namespace {

constexpr double kMaxError_rad = 0.0035;

struct Rays {
  Eigen::Matrix3Xd first, second;
};

RigidTransform secondFromFirst() {
  return {rotationFromVector({0.1, -0.05, 0.2}), {0.8, 0.1, -0.3}};
}

/// Rays to random points from two places; the last `num_wrong` second rays point anywhere.
Rays makeRays(int count, int num_wrong, double noise_rad, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)); };
  const RigidTransform second_from_first = secondFromFirst();
  Rays rays{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d point = 5.0 * draw();
    rays.first.col(i) = (point.normalized() + noise_rad * draw()).normalized();
    rays.second.col(i) = ((second_from_first * point).normalized() + noise_rad * draw()).normalized();
    if (i >= count - num_wrong) {
      rays.second.col(i) = draw().normalized();
    }
  }
  return rays;
}

TEST(EpipolarJudgeTest, CountsTheRightMatchesAmongWrongOnes) {
  const Rays rays = makeRays(200, 80, 0.0005, 1);
  const EpipolarJudgement judgement = judgeMatches(rays.first, rays.second, kMaxError_rad, 1);
  EXPECT_GE(judgement.right, 118);
  EXPECT_LE(judgement.right, 124) << "a wrong ray lies near its plane by chance with 0.4 %";
}

TEST(EpipolarJudgeTest, TheErrorIsProportionalToTheNoise) {
  const auto errorOf = [](double noise_rad) {
    const Rays rays = makeRays(300, 0, noise_rad, 5);
    return judgeMatches(rays.first, rays.second, 10.0 * noise_rad, 1).median_error_rad / noise_rad;
  };
  // The noise of both rays adds up: its median is 0.67 sqrt(2) where both planes tilt alike, else more.
  EXPECT_GT(errorOf(0.0002), 0.9);
  EXPECT_LT(errorOf(0.0002), 2.0);
  EXPECT_NEAR(errorOf(0.0002), errorOf(0.0004), 0.1);
}

TEST(EpipolarJudgeTest, CountsByAKnownPose) {
  const Rays rays = makeRays(200, 80, 0.0005, 1);
  const EpipolarJudgement judgement = judgeMatches(rays.first, rays.second, kMaxError_rad, secondFromFirst());
  EXPECT_GE(judgement.right, 118);
  EXPECT_LE(judgement.right, 124);
  EXPECT_LT(judgeMatches(rays.first, rays.second, kMaxError_rad, secondFromFirst().inverse()).right, 10);
}

TEST(EpipolarJudgeTest, FindsAlmostNoneAmongWrongOnesAlone) {
  const Rays rays = makeRays(100, 100, 0.0, 2);
  EXPECT_LT(judgeMatches(rays.first, rays.second, kMaxError_rad, 1).right, 20);
}

TEST(EpipolarJudgeTest, FewBadOrEqualRaysAreNoCrash) {
  Rays rays = makeRays(30, 0, 0.0, 3);
  EXPECT_EQ(judgeMatches(rays.first.leftCols(7), rays.second.leftCols(7), kMaxError_rad, 1).right, 0);
  EXPECT_EQ(judgeMatches({}, {}, kMaxError_rad, 1).right, 0);
  rays.second.col(4).setConstant(NAN);
  EXPECT_EQ(judgeMatches(rays.first, rays.second, kMaxError_rad, 1).right, 29);
  rays.first.colwise() = Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  rays.second = rays.first;
  EXPECT_LE(judgeMatches(rays.first, rays.second, kMaxError_rad, 1, 50).right, 30);
  EXPECT_THROW(judgeMatches(rays.first, rays.second.leftCols(3), kMaxError_rad, 1), std::logic_error);
}

}  // namespace
}  // namespace vcharge
