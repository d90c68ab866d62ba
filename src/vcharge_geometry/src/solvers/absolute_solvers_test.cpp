#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "solvers/random_problems.h"
#include "vcharge_geometry/solvers/generalized_three_point.h"
#include "vcharge_geometry/solvers/perspective_three_point.h"
#include "vcharge_geometry/solvers/upright_two_point.h"

namespace vcharge {
namespace {

constexpr int kNumProblems = 10000;

/// Largest angle between a ray and the direction to its point under a pose.
template <class Matches>
double largestAngle(const Matches& matches, const RotationTranslation& map_from_rig) {
  double largest = 0.0;
  for (const PointMatch& match : matches) {
    const Eigen::Vector3d in_rig =
        map_from_rig.rotation.transpose() * (match.point_m - map_from_rig.translation_m);
    const Eigen::Vector3d seen = in_rig - match.ray.origin_m;
    largest =
        std::max(largest, std::atan2(seen.cross(match.ray.direction).norm(), seen.dot(match.ray.direction)));
  }
  return largest;
}

TEST(GeneralizedThreePointTest, SolvesRandomProblemsForEverySpreadOfTheCentres) {
  // Camera centres from the spread of a car's rig down to a single centre.
  for (const double spread : {1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13, 1e-14, 1e-15, 0.0}) {
    RandomProblems random(1);
    std::vector<double> errors;
    int most_solutions = 0;
    double largest_angle = 0.0;
    for (int i = 0; i < kNumProblems; ++i) {
      const RigidTransform truth = random.pose();
      const std::array<PointMatch, 3> matches = random.pointMatches<3>(truth, spread);
      FixedVector<RotationTranslation, 8> poses;
      ASSERT_EQ(solveGeneralizedThreePoint(matches, &poses), SolverStatus::kOk);
      errors.push_back(smallestError(poses, truth));
      most_solutions = std::max(most_solutions, poses.size());
      for (const RotationTranslation& pose : poses) {
        largest_angle = std::max(largest_angle, largestAngle(matches, pose));
      }
    }
    EXPECT_LE(quantile(errors, 0.5), 1e-12) << spread;
    EXPECT_LE(quantile(errors, 0.99), 1e-10) << spread;
    EXPECT_LE(quantile(errors, 0.999), 1e-8) << spread;
    EXPECT_LE(quantile(errors, 1.0), 0.1) << spread;
    EXPECT_LE(largest_angle, 1e-6) << spread;
    EXPECT_GE(most_solutions, 4) << spread;
  }
}

TEST(GeneralizedThreePointTest, FindsBothPosesOfSymmetricTriangles) {
  // An isosceles triangle symmetric to the y-z plane: two poses have the same depth of the first point.
  const std::array<Eigen::Vector3d, 3> points{Eigen::Vector3d(0.0, -0.5, 5.0), Eigen::Vector3d(1.0, 1.0, 6.0),
                                              Eigen::Vector3d(-1.0, 1.0, 6.0)};
  for (const double spread : {0.0, 1e-9, 1e-3}) {
    std::array<PointMatch, 3> matches;
    for (size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d origin(i == 0 ? 0.0 : (i == 1 ? spread : -spread), 0.0, 0.0);
      matches[i] = {{origin, (points[i] - origin).normalized()}, points[i]};
    }
    FixedVector<RotationTranslation, 8> poses;
    ASSERT_EQ(solveGeneralizedThreePoint(matches, &poses), SolverStatus::kOk);
    EXPECT_LE(smallestError(poses, RigidTransform()), 1e-6) << spread;
    for (const RotationTranslation& pose : poses) {
      EXPECT_LE(largestAngle(matches, pose), 1e-7);
    }
  }
}

TEST(GeneralizedThreePointTest, ErrorGrowsInProportionToNoise) {
  std::vector<double> medians;
  for (const double sigma_rad : {1e-7, 1e-5}) {
    RandomProblems random(2);
    std::vector<double> errors;
    for (int i = 0; i < kNumProblems; ++i) {
      const RigidTransform truth = random.pose();
      FixedVector<RotationTranslation, 8> poses;
      solveGeneralizedThreePoint(random.pointMatches<3>(truth, 1.0, sigma_rad), &poses);
      errors.push_back(smallestError(poses, truth));
    }
    medians.push_back(quantile(errors, 0.5));
  }
  EXPECT_LE(medians[1], 1e-3);
  EXPECT_GT(medians[1] / medians[0], 80.0);
  EXPECT_LT(medians[1] / medians[0], 120.0);
}

TEST(GeneralizedThreePointTest, AcceptsParallelRays) {
  // Two parallel rays of different cameras: the mixed term of the pair is extreme, but the pose is not.
  RandomProblems random(3);
  std::vector<double> errors;
  for (int i = 0; i < 1000; ++i) {
    const RigidTransform truth = random.pose();
    std::array<PointMatch, 3> matches = random.pointMatches<3>(truth);
    const Ray first = {RandomProblems::cameraCentre(0), random.direction()};
    const Ray second = {RandomProblems::cameraCentre(1), first.direction};
    matches[0] = {first,
                  truth * Eigen::Vector3d(first.origin_m + random.uniform(2.0, 10.0) * first.direction)};
    matches[1] = {second,
                  truth * Eigen::Vector3d(second.origin_m + random.uniform(2.0, 10.0) * second.direction)};
    FixedVector<RotationTranslation, 8> poses;
    ASSERT_EQ(solveGeneralizedThreePoint(matches, &poses), SolverStatus::kOk);
    errors.push_back(smallestError(poses, truth));
  }
  EXPECT_LE(quantile(errors, 0.5), 1e-11);
  EXPECT_LE(quantile(errors, 0.99), 1e-6);
}

TEST(PerspectiveThreePointTest, SolvesRandomProblemsWithUpToFourPoses) {
  RandomProblems random(4);
  std::vector<double> errors;
  int most_solutions = 0;
  for (int i = 0; i < kNumProblems; ++i) {
    const RigidTransform truth = random.pose();
    FixedVector<RotationTranslation, 4> poses;
    ASSERT_EQ(solvePerspectiveThreePoint(random.pointMatches<3>(truth, 0.0), &poses), SolverStatus::kOk);
    errors.push_back(smallestError(poses, truth));
    most_solutions = std::max(most_solutions, poses.size());
  }
  EXPECT_LE(quantile(errors, 0.5), 1e-12);
  EXPECT_LE(quantile(errors, 0.99), 1e-10);
  EXPECT_LE(quantile(errors, 0.9995), 1e-6);
  EXPECT_EQ(most_solutions, 4);
}

TEST(UprightTwoPointTest, SolvesRandomProblems) {
  RandomProblems random(5);
  std::vector<double> errors;
  int num_double = 0;
  for (int i = 0; i < kNumProblems; ++i) {
    const RigidTransform truth = random.uprightPose();
    const std::array<PointMatch, 2> matches = random.pointMatches<2>(truth, i % 2 == 0 ? 1.0 : 0.0);
    FixedVector<RotationTranslation, 2> poses;
    ASSERT_EQ(solveUprightTwoPoint(matches, &poses), SolverStatus::kOk);
    errors.push_back(smallestError(poses, truth));
    num_double += poses.size() == 2 ? 1 : 0;
    for (const RotationTranslation& pose : poses) {
      EXPECT_LE(largestAngle(matches, pose), 1e-6);
    }
  }
  EXPECT_LE(quantile(errors, 0.5), 1e-12);
  EXPECT_LE(quantile(errors, 0.99), 1e-10);
  EXPECT_LE(quantile(errors, 1.0), 1e-6);
  EXPECT_GT(num_double, kNumProblems / 20);
}

TEST(UprightTwoPointTest, RejectsHorizontalAndParallelRays) {
  std::array<PointMatch, 2> matches;
  matches[0] = {{Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0)}, Eigen::Vector3d(5, 0, 1)};
  matches[1] = {{Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 1, 0)}, Eigen::Vector3d(0, 5, 1)};
  FixedVector<RotationTranslation, 2> poses;
  EXPECT_EQ(solveUprightTwoPoint(matches, &poses), SolverStatus::kDegenerate);
  const Eigen::Vector3d down = Eigen::Vector3d(1, 0, -1).normalized();
  matches[0] = {{Eigen::Vector3d(0, 0, 1), down}, Eigen::Vector3d(1, 0, 0)};
  matches[1] = {{Eigen::Vector3d(0, 2, 1), down}, Eigen::Vector3d(1, 2, 0)};
  EXPECT_EQ(solveUprightTwoPoint(matches, &poses), SolverStatus::kDegenerate);
  EXPECT_TRUE(poses.empty());
}

TEST(AbsoluteSolversTest, RejectWhatHasNoAnswer) {
  RandomProblems random(6);
  const std::array<PointMatch, 3> good = random.pointMatches<3>(random.pose());
  FixedVector<RotationTranslation, 8> poses;
  FixedVector<RotationTranslation, 4> central_poses;
  FixedVector<RotationTranslation, 2> upright_poses;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const int where : {0, 1, 2}) {
      std::array<PointMatch, 3> matches = good;
      (where == 0   ? matches[1].ray.direction
       : where == 1 ? matches[1].point_m
                    : matches[0].ray.origin_m)
          .y() = bad;
      EXPECT_EQ(solveGeneralizedThreePoint(matches, &poses), SolverStatus::kNotFinite) << where;
      EXPECT_EQ(solvePerspectiveThreePoint(matches, &central_poses), SolverStatus::kNotFinite) << where;
      EXPECT_EQ(solveUprightTwoPoint({matches[0], matches[1]}, &upright_poses), SolverStatus::kNotFinite)
          << where;
      EXPECT_TRUE(poses.empty() && central_poses.empty() && upright_poses.empty());
    }
  }
  std::array<PointMatch, 3> collinear = good;
  collinear[2].point_m = 3.0 * good[0].point_m - 2.0 * good[1].point_m;
  EXPECT_EQ(solveGeneralizedThreePoint(collinear, &poses), SolverStatus::kDegenerate);
  EXPECT_EQ(solvePerspectiveThreePoint(collinear, &central_poses), SolverStatus::kDegenerate);
  EXPECT_EQ(solveGeneralizedThreePoint({good[0], good[0], good[0]}, &poses), SolverStatus::kDegenerate);
  EXPECT_EQ(solvePerspectiveThreePoint({good[0], good[0], good[0]}, &central_poses),
            SolverStatus::kDegenerate);
  EXPECT_EQ(solveUprightTwoPoint({good[0], good[0]}, &upright_poses), SolverStatus::kDegenerate);
}

}  // namespace
}  // namespace vcharge
