#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "solvers/random_problems.h"
#include "vcharge_geometry/solvers/ackermann_two_point.h"
#include "vcharge_geometry/solvers/known_vertical_four_point.h"
#include "vcharge_geometry/solvers/planar_three_point.h"

namespace vcharge {
namespace {

constexpr int kNumProblems = 10000;

/// Common interface of the relative solvers, so that every property is tested on each.
struct AckermannSolver {
  static constexpr size_t kNumMatches = 2;
  static constexpr int kMaxSolutions = 3;
  static SolverStatus solve(const std::array<LineMatch, 2>& matches, FixedVector<YawMotion, 3>* motions) {
    return solveAckermannTwoPoint(matches, motions);
  }
  static RigidTransform motion(RandomProblems* random) {
    return RandomProblems::ackermannMotion(random->uniform(-0.5, 0.5), random->uniform(-1.0, 2.0));
  }
  static RigidTransform straightMotion(RandomProblems* random) {
    return RandomProblems::ackermannMotion(0.0, random->uniform(0.1, 2.0));
  }
};

struct PlanarSolver {
  static constexpr size_t kNumMatches = 3;
  static constexpr int kMaxSolutions = 4;
  static SolverStatus solve(const std::array<LineMatch, 3>& matches, FixedVector<YawMotion, 4>* motions) {
    return solvePlanarThreePoint(matches, motions);
  }
  static RigidTransform motion(RandomProblems* random) {
    return RigidTransform::planar(random->normal(1.0), random->normal(1.0), random->uniform(-M_PI, M_PI));
  }
  static RigidTransform straightMotion(RandomProblems* random) {
    return RigidTransform::planar(random->normal(1.0), random->normal(1.0), 0.0);
  }
};

struct KnownVerticalSolver {
  static constexpr size_t kNumMatches = 4;
  static constexpr int kMaxSolutions = 6;
  static SolverStatus solve(const std::array<LineMatch, 4>& matches, FixedVector<YawMotion, 6>* motions) {
    return solveKnownVerticalFourPoint(matches, motions);
  }
  static RigidTransform motion(RandomProblems* random) {
    return RigidTransform(rotationFromYawPitchRoll(random->uniform(-M_PI, M_PI), 0.0, 0.0),
                          Eigen::Vector3d(random->normal(1.0), random->normal(1.0), random->normal(1.0)));
  }
  static RigidTransform straightMotion(RandomProblems* random) {
    return RigidTransform(Eigen::Quaterniond::Identity(),
                          Eigen::Vector3d(random->normal(1.0), random->normal(1.0), random->normal(1.0)));
  }
};

template <class Solver>
class RelativeSolverTest : public testing::Test {
 protected:
  using Matches = std::array<LineMatch, Solver::kNumMatches>;
  using Motions = FixedVector<YawMotion, Solver::kMaxSolutions>;
};

using RelativeSolvers = testing::Types<AckermannSolver, PlanarSolver, KnownVerticalSolver>;
TYPED_TEST_SUITE(RelativeSolverTest, RelativeSolvers);

TYPED_TEST(RelativeSolverTest, SolvesRandomProblemsToRounding) {
  for (const double same_camera : {0.0, 0.5, 1.0}) {
    RandomProblems random(1);
    std::vector<double> errors;
    int most_solutions = 0;
    double largest_constraint = 0.0;
    for (int i = 0; i < kNumProblems; ++i) {
      const RigidTransform truth = TypeParam::motion(&random);
      const typename TestFixture::Matches matches =
          random.lineMatches<TypeParam::kNumMatches>(truth, same_camera);
      typename TestFixture::Motions motions;
      ASSERT_EQ(TypeParam::solve(matches, &motions), SolverStatus::kOk);
      errors.push_back(smallestError(motions, truth));
      most_solutions = std::max(most_solutions, motions.size());
      // Every solution must satisfy the generalized epipolar constraint, not only the true one.
      for (const YawMotion& motion : motions) {
        const RigidTransform transform = motion.transform();
        const double size = 1.0 + transform.translation().norm();
        for (const LineMatch& match : matches) {
          const double constraint = std::abs(generalizedEpipolarConstraint(match, transform)) / size;
          largest_constraint = std::max(largest_constraint, motion.scale_observable ? constraint : 0.0);
        }
      }
    }
    EXPECT_LE(quantile(errors, 0.5), 1e-12) << "same camera: " << same_camera;
    EXPECT_LE(quantile(errors, 0.99), 1e-8) << "same camera: " << same_camera;
    EXPECT_LE(quantile(errors, 1.0), 1e-3) << "same camera: " << same_camera;
    EXPECT_LE(largest_constraint, 1e-4) << "same camera: " << same_camera;
    EXPECT_LE(most_solutions, TypeParam::kMaxSolutions);
    // Problems within one camera have no trivial root.
    EXPECT_EQ(most_solutions, TypeParam::kMaxSolutions - (same_camera == 1.0 ? 1 : 0));
  }
}

TYPED_TEST(RelativeSolverTest, ErrorGrowsInProportionToNoise) {
  // The median error must be proportional to the noise, which a wrong equation would violate.
  std::vector<double> medians;
  for (const double sigma_rad : {1e-7, 1e-5}) {
    RandomProblems random(2);
    std::vector<double> errors;
    for (int i = 0; i < kNumProblems; ++i) {
      const RigidTransform truth = TypeParam::motion(&random);
      typename TestFixture::Motions motions;
      TypeParam::solve(random.lineMatches<TypeParam::kNumMatches>(truth, 0.5, sigma_rad), &motions);
      errors.push_back(smallestError(motions, truth));
    }
    medians.push_back(quantile(errors, 0.5));
    EXPECT_LE(medians.back(), 1e3 * sigma_rad);
  }
  EXPECT_GT(medians[1] / medians[0], 50.0);
  EXPECT_LT(medians[1] / medians[0], 200.0);
}

TYPED_TEST(RelativeSolverTest, SaysThatStraightMotionWithinCamerasHidesTheScale) {
  RandomProblems random(3);
  int num_right = 0;
  for (int i = 0; i < kNumProblems; ++i) {
    const RigidTransform truth = TypeParam::straightMotion(&random);
    typename TestFixture::Motions motions;
    ASSERT_EQ(TypeParam::solve(random.lineMatches<TypeParam::kNumMatches>(truth, 1.0), &motions),
              SolverStatus::kOk);
    int num_hidden = 0;
    bool right = true;
    for (const YawMotion& motion : motions) {
      if (!motion.scale_observable) {
        ++num_hidden;
        // The direction has length 1; its sign is known because points lie in front of the cameras.
        right = right && std::abs(motion.yaw()) < 1e-6 &&
                (motion.transform().translation() - truth.translation().normalized()).norm() < 1e-3;
      }
    }
    num_right += right && num_hidden == 1 ? 1 : 0;
  }
  // The remaining problems have nearly parallel rows for any yaw.
  EXPECT_GE(num_right, static_cast<int>(0.999 * kNumProblems));
}

TYPED_TEST(RelativeSolverTest, FindsStraightMotionWithScaleAcrossCameras) {
  RandomProblems random(4);
  std::vector<double> errors;
  for (int i = 0; i < kNumProblems; ++i) {
    const RigidTransform truth = TypeParam::straightMotion(&random);
    typename TestFixture::Matches matches = random.lineMatches<TypeParam::kNumMatches>(truth, 1.0);
    matches[0] = random.lineMatch(truth, 0, 1);
    typename TestFixture::Motions motions;
    ASSERT_EQ(TypeParam::solve(matches, &motions), SolverStatus::kOk);
    errors.push_back(smallestError(motions, truth));
  }
  EXPECT_LE(quantile(errors, 0.5), 1e-10);
  // One match across cameras makes the scale observable, and zero yaw a double root of the polynomial.
  EXPECT_LE(quantile(errors, 0.99), 1e-3);
}

TYPED_TEST(RelativeSolverTest, FindsHalfTurnsAndCoplanarPoints) {
  RandomProblems random(5);
  std::vector<double> errors;
  for (int i = 0; i < 1000; ++i) {
    const bool is_ackermann = TypeParam::kNumMatches == 2;
    const RigidTransform truth =
        is_ackermann ? TypeParam::motion(&random) : RigidTransform::planar(random.normal(1.0), 2.0, M_PI);
    typename TestFixture::Matches matches;
    for (size_t k = 0; k < matches.size(); ++k) {
      // Points on the ground.
      const Eigen::Vector3d point(random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0), 0.0);
      const int camera = static_cast<int>(k);
      matches[k] = {lineOfRay(RandomProblems::rayTo(point, camera)),
                    lineOfRay(RandomProblems::rayTo(truth.inverse() * point, (camera + 2) % 4))};
    }
    typename TestFixture::Motions motions;
    ASSERT_EQ(TypeParam::solve(matches, &motions), SolverStatus::kOk);
    errors.push_back(smallestError(motions, truth));
  }
  EXPECT_LE(quantile(errors, 0.5), 1e-11);
  EXPECT_LE(quantile(errors, 0.98), 1e-6);
}

TYPED_TEST(RelativeSolverTest, KnowsForwardFromBackward) {
  // The inverse of an Ackermann motion has the same form and differs only in the sign.
  RandomProblems random(6);
  for (int i = 0; i < 1000; ++i) {
    const RigidTransform truth =
        RandomProblems::ackermannMotion(random.uniform(0.1, 0.5), random.uniform(0.5, 1.0));
    const typename TestFixture::Matches matches = random.lineMatches<TypeParam::kNumMatches>(truth, 0.0);
    typename TestFixture::Motions motions;
    ASSERT_EQ(TypeParam::solve(matches, &motions), SolverStatus::kOk);
    double closest = INFINITY;
    YawMotion best;
    for (const YawMotion& motion : motions) {
      const double error = transformError(motion.transform(), truth);
      if (error < closest) {
        closest = error;
        best = motion;
      }
    }
    EXPECT_GT(best.along, 0.4);
    EXPECT_GT(best.yaw(), 0.05);
  }
}

TYPED_TEST(RelativeSolverTest, RejectsWhatHasNoAnswer) {
  RandomProblems random(7);
  const RigidTransform truth = TypeParam::motion(&random);
  const typename TestFixture::Matches good = random.lineMatches<TypeParam::kNumMatches>(truth, 0.0);
  typename TestFixture::Motions motions;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    typename TestFixture::Matches matches = good;
    matches[1].current.direction.y() = bad;
    EXPECT_EQ(TypeParam::solve(matches, &motions), SolverStatus::kNotFinite);
    EXPECT_TRUE(motions.empty());
    matches = good;
    matches[0].previous.moment_m.x() = bad;
    EXPECT_EQ(TypeParam::solve(matches, &motions), SolverStatus::kNotFinite);
    EXPECT_TRUE(motions.empty());
  }
  typename TestFixture::Matches equal;
  equal.fill(good[0]);
  EXPECT_EQ(TypeParam::solve(equal, &motions), SolverStatus::kDegenerate);
  EXPECT_TRUE(motions.empty());
  typename TestFixture::Matches zero;
  zero.fill({{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()},
             {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}});
  EXPECT_EQ(TypeParam::solve(zero, &motions), SolverStatus::kDegenerate);
}

}  // namespace
}  // namespace vcharge
