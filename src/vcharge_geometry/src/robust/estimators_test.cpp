#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "solvers/random_problems.h"
#include "vcharge_geometry/robust/motion_estimation.h"
#include "vcharge_geometry/robust/pose_estimation.h"
#include "vcharge_geometry/robust/robust_estimation.h"

namespace vcharge {
namespace {

/// Matches, the first num_wrong of which are wrong: their two points are unrelated.
std::vector<RayMatch> rayMatches(RandomProblems* random, const RigidTransform& previous_from_current,
                                 int num_matches, int num_wrong, double sigma_rad, double same_camera = 0.8) {
  std::vector<RayMatch> matches;
  for (int i = 0; i < num_matches; ++i) {
    RayMatch match;
    match.previous_camera = random->integer(4);
    match.current_camera =
        random->uniform(0.0, 1.0) < same_camera ? match.previous_camera : random->integer(4);
    const Eigen::Vector3d point = random->point();
    const Eigen::Vector3d seen = i < num_wrong ? random->point() : point;
    match.previous = random->disturbed(RandomProblems::rayTo(point, match.previous_camera), sigma_rad);
    match.current = random->disturbed(
        RandomProblems::rayTo(previous_from_current.inverse() * seen, match.current_camera), sigma_rad);
    matches.push_back(match);
  }
  return matches;
}

std::vector<PointMatch> pointMatches(RandomProblems* random, const RigidTransform& map_from_rig,
                                     int num_matches, int num_wrong, double sigma_rad) {
  std::vector<PointMatch> matches;
  for (int i = 0; i < num_matches; ++i) {
    PointMatch match;
    match.camera = random->integer(4);
    const Eigen::Vector3d point = random->point();
    match.ray = random->disturbed(RandomProblems::rayTo(point, match.camera), sigma_rad);
    match.point_m = map_from_rig * (i < num_wrong ? random->point() : point);
    matches.push_back(match);
  }
  return matches;
}

/// Error of an estimate as [dt, dphi].
Eigen::Matrix<double, 6, 1> errorOf(const RigidTransform& estimate, const RigidTransform& truth) {
  Eigen::Matrix<double, 6, 1> error;
  error << truth.translation() - estimate.translation(),
      vectorFromRotation(truth.rotation() * estimate.rotation().conjugate());
  return error;
}

RigidTransform randomPlanarMotion(RandomProblems* random) {
  return RigidTransform::planar(random->normal(1.0), random->normal(1.0), random->uniform(-M_PI, M_PI));
}

RigidTransform randomUprightMotion(RandomProblems* random) {
  return RigidTransform(rotationFromYawPitchRoll(random->uniform(-M_PI, M_PI), 0.0, 0.0),
                        Eigen::Vector3d(random->normal(1.0), random->normal(1.0), random->normal(0.3)));
}

RigidTransform randomAckermannMotion(RandomProblems* random) {
  return RandomProblems::ackermannMotion(random->uniform(0.05, 0.3), random->uniform(0.3, 1.0));
}

constexpr int kNumMatches = 400;

TEST(EstimatorsTest, ReproduceTheIterationTable) {
  // For a confidence of 99 % at an inlier ratio of 50 %: 16, 34-35 and 72 iterations for 2, 3 and 4 matches
  // (292 and 603606 for 6 and 17).
  EXPECT_EQ(std::lround(iterationsForConfidence(0.5, 2, 0.99)), 16);
  EXPECT_EQ(std::floor(iterationsForConfidence(0.5, 3, 0.99)), 34);
  EXPECT_EQ(std::ceil(iterationsForConfidence(0.5, 3, 0.99)), 35);
  EXPECT_EQ(std::lround(iterationsForConfidence(0.5, 6, 0.99)), 292);
  EXPECT_EQ(std::floor(iterationsForConfidence(0.5, 17, 0.99)), 603606);
  // Runs exactly that many iterations on noise-free matches and counts how often the best model is right.
  constexpr int kTrials = 2000;
  RobustOptions options;
  options.max_error_rad = 1e-6;
  options.confidence = 1.0 - 1e-15;  // never stops early
  options.refine_best_models = false;
  RandomProblems random(1);
  std::vector<double> successes(5, 0.0);
  for (int trial = 0; trial < kTrials; ++trial) {
    options.seed = trial;
    const auto withIterations = [&options](int iterations) {
      options.max_iterations = iterations;
      return options;
    };
    const auto succeeded = [](const RigidTransform& found, const RigidTransform& truth) {
      return transformError(found, truth) < 1e-4 ? 1.0 : 0.0;
    };
    const RigidTransform ackermann = randomAckermannMotion(&random);
    const RigidTransform planar = randomPlanarMotion(&random);
    const RigidTransform upright = randomUprightMotion(&random);
    const RigidTransform pose = random.pose();
    const RigidTransform upright_pose = random.uprightPose();
    const Eigen::Quaterniond level = Eigen::Quaterniond::Identity();
    successes[0] +=
        succeeded(estimateAckermannMotion(rayMatches(&random, ackermann, 200, 100, 0.0), withIterations(16))
                      .previous_from_current,
                  ackermann);
    successes[1] +=
        succeeded(estimatePlanarMotion(rayMatches(&random, planar, 200, 100, 0.0), withIterations(35))
                      .previous_from_current,
                  planar);
    successes[2] += succeeded(estimateKnownVerticalMotion(rayMatches(&random, upright, 200, 100, 0.0), level,
                                                          level, withIterations(72))
                                  .previous_from_current,
                              upright);
    successes[3] += succeeded(
        estimateAbsolutePose(pointMatches(&random, pose, 200, 100, 0.0), withIterations(35)).map_from_rig,
        pose);
    successes[4] += succeeded(
        estimateUprightPose(pointMatches(&random, upright_pose, 200, 100, 0.0), level, withIterations(16))
            .map_from_rig,
        upright_pose);
  }
  // 0.99, minus the effect of drawing without replacement from 200, with 4 binomial deviations of 0.0022.
  for (const double success : successes) {
    EXPECT_GE(success / kTrials, 0.978);
    EXPECT_LE(success / kTrials, 0.999);
  }
}

class EstimatorAccuracyTest : public testing::TestWithParam<int> {};

TEST_P(EstimatorAccuracyTest, EstimatesAreRightAndKnowTheirError) {
  constexpr int kTrials = 300;
  constexpr double kSigma = 1e-3;
  RandomProblems random(2);
  RobustOptions options;
  options.max_error_rad = 3.0 * kSigma;
  struct Model {
    const char* name;
    int degrees_of_freedom;
    std::vector<double> nees;
    std::vector<double> errors;
  };
  std::vector<Model> models{{"Ackermann", 2}, {"planar", 3},   {"known vertical", 4},
                            {"free", 6},      {"absolute", 6}, {"upright", 4}};
  const auto judge = [](const RigidTransform& found, const Eigen::Matrix<double, 6, 6>& covariance,
                        const RigidTransform& truth, Model* model) {
    const Eigen::Matrix<double, 6, 1> error = errorOf(found, truth);
    // Uses only the degrees of freedom of the motion model.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(covariance);
    double nees = 0.0;
    for (int i = 6 - model->degrees_of_freedom; i < 6; ++i) {
      const double component = eigen.eigenvectors().col(i).dot(error);
      nees += component * component / eigen.eigenvalues()[i] / model->degrees_of_freedom;
    }
    model->nees.push_back(nees);
    model->errors.push_back(error.norm());
  };
  const int num_wrong = GetParam();
  for (int trial = 0; trial < kTrials; ++trial) {
    const RigidTransform ackermann = randomAckermannMotion(&random);
    const MotionEstimate two_point =
        estimateAckermannMotion(rayMatches(&random, ackermann, kNumMatches, num_wrong, kSigma), options);
    ASSERT_EQ(two_point.status, EstimationStatus::kOk) << trial;
    judge(two_point.previous_from_current, two_point.covariance, ackermann, &models[0]);
    EXPECT_NEAR(two_point.noise_rad, kSigma, 0.5 * kSigma);
    const RigidTransform planar = randomPlanarMotion(&random);
    const MotionEstimate three_point =
        estimatePlanarMotion(rayMatches(&random, planar, kNumMatches, num_wrong, kSigma), options);
    ASSERT_EQ(three_point.status, EstimationStatus::kOk) << trial;
    judge(three_point.previous_from_current, three_point.covariance, planar, &models[1]);
    // On a ramp, roll and pitch differ between the frames.
    const RigidTransform upright = randomUprightMotion(&random);
    const Eigen::Quaterniond previous_tilt = random.rotation(0.3);
    const Eigen::Quaterniond current_tilt = random.rotation(0.3);
    const RigidTransform tilted(previous_tilt.conjugate() * upright.rotation() * current_tilt,
                                previous_tilt.conjugate() * upright.translation());
    const std::vector<RayMatch> tilted_matches = rayMatches(&random, tilted, kNumMatches, num_wrong, kSigma);
    const MotionEstimate four_point =
        estimateKnownVerticalMotion(tilted_matches, previous_tilt, current_tilt, options);
    ASSERT_EQ(four_point.status, EstimationStatus::kOk) << trial;
    judge(four_point.previous_from_current, four_point.covariance, tilted, &models[2]);
    const MotionEstimate refined = refineMotion(tilted_matches, four_point.previous_from_current, options);
    ASSERT_EQ(refined.status, EstimationStatus::kOk) << trial;
    judge(refined.previous_from_current, refined.covariance, tilted, &models[3]);
    const RigidTransform pose = random.pose();
    const PoseEstimate absolute =
        estimateAbsolutePose(pointMatches(&random, pose, kNumMatches, num_wrong, kSigma), options);
    ASSERT_EQ(absolute.status, EstimationStatus::kOk) << trial;
    judge(absolute.map_from_rig, absolute.covariance, pose, &models[4]);
    EXPECT_NEAR(absolute.noise_rad, kSigma, 0.2 * kSigma);
    const RigidTransform upright_pose = random.uprightPose();
    const RigidTransform tilted_pose(upright_pose.rotation() * previous_tilt, upright_pose.translation());
    const PoseEstimate two_point_pose = estimateUprightPose(
        pointMatches(&random, tilted_pose, kNumMatches, num_wrong, kSigma), previous_tilt, options);
    ASSERT_EQ(two_point_pose.status, EstimationStatus::kOk) << trial;
    judge(two_point_pose.map_from_rig, two_point_pose.covariance, tilted_pose, &models[5]);
  }
  for (const Model& model : models) {
    // Normalized squared error per degree of freedom: mean 1 for a correct covariance, 90 % below 2.3.
    if (num_wrong == 0) {
      double mean = 0.0;
      for (const double nees : model.nees) {
        mean += nees / kTrials;
      }
      EXPECT_NEAR(mean, 1.0, 0.25) << model.name;
    }
    // Wrong matches near their epipolar planes and close to a camera bias some estimates.
    EXPECT_LT(quantile(model.nees, 0.5), 1.3) << model.name;
    EXPECT_LT(quantile(model.nees, 0.85), 3.0) << model.name;
    EXPECT_LT(quantile(model.errors, 0.5), 0.01) << model.name;
    EXPECT_LT(quantile(model.errors, 0.95), 0.05) << model.name;
  }
}

INSTANTIATE_TEST_SUITE_P(NumberOfWrongMatches, EstimatorAccuracyTest, testing::Values(0, kNumMatches / 2));

TEST(EstimatorsTest, SayThatStraightMotionWithinCamerasHidesTheScale) {
  RandomProblems random(3);
  const RobustOptions options;
  for (int trial = 0; trial < 50; ++trial) {
    const double distance_m = trial % 2 == 0 ? 0.5 : -0.5;
    const RigidTransform truth = RandomProblems::ackermannMotion(0.0, distance_m);
    const std::vector<RayMatch> matches = rayMatches(&random, truth, kNumMatches, kNumMatches / 4, 1e-3, 1.0);
    for (const MotionEstimate& estimate :
         {estimateAckermannMotion(matches, options), estimatePlanarMotion(matches, options)}) {
      ASSERT_EQ(estimate.status, EstimationStatus::kScaleUnobservable);
      EXPECT_NEAR(estimate.previous_from_current.translation().norm(), 1.0, 1e-9);
      EXPECT_GT(estimate.previous_from_current.translation().x() * distance_m, 0.49);
      EXPECT_LT(angleOfRotation(estimate.previous_from_current.rotation()), 5e-3);
    }
    // Matches across cameras make the scale and its sign observable.
    const MotionEstimate estimate =
        estimateAckermannMotion(rayMatches(&random, truth, kNumMatches, kNumMatches / 4, 1e-3, 0.5), options);
    ASSERT_EQ(estimate.status, EstimationStatus::kOk);
    EXPECT_NEAR(estimate.previous_from_current.translation().x(), distance_m, 0.05);
  }
}

TEST(EstimatorsTest, OrderingByQualitySavesIterations) {
  RandomProblems random(4);
  RobustOptions options;
  int ordered = 0;
  int unordered = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const RigidTransform truth = random.pose();
    std::vector<PointMatch> matches = pointMatches(&random, truth, kNumMatches, 3 * kNumMatches / 4, 1e-3);
    for (size_t i = 0; i < matches.size(); ++i) {
      // The last quarter is right and has a higher quality on average.
      matches[i].quality = random.uniform(0.0, 1.0) + (i >= 3 * matches.size() / 4 ? 0.5 : 0.0);
    }
    const auto iterationsUntilRight = [&](bool by_quality) {
      options.order_by_quality = by_quality;
      options.seed = trial;
      for (options.max_iterations = 1; options.max_iterations < 4096; options.max_iterations *= 2) {
        const PoseEstimate estimate = estimateAbsolutePose(matches, options);
        if (estimate.status == EstimationStatus::kOk && transformError(estimate.map_from_rig, truth) < 0.1) {
          break;
        }
      }
      return options.max_iterations;
    };
    ordered += iterationsUntilRight(true);
    unordered += iterationsUntilRight(false);
  }
  EXPECT_LT(2 * ordered, unordered);
}

TEST(EstimatorsTest, RepeatExactly) {
  RandomProblems random(5);
  const RigidTransform truth = randomPlanarMotion(&random);
  const std::vector<RayMatch> matches = rayMatches(&random, truth, kNumMatches, kNumMatches / 2, 1e-3);
  const MotionEstimate first = estimatePlanarMotion(matches, RobustOptions());
  const MotionEstimate second = estimatePlanarMotion(matches, RobustOptions());
  EXPECT_EQ(first.previous_from_current.matrix(), second.previous_from_current.matrix());
  EXPECT_EQ(first.covariance, second.covariance);
  EXPECT_EQ(first.inliers, second.inliers);
}

TEST(EstimatorsTest, BadInputGivesAStatus) {
  RandomProblems random(6);
  const RigidTransform truth = randomAckermannMotion(&random);
  const std::vector<RayMatch> good = rayMatches(&random, truth, kNumMatches, 0, 1e-3);
  const std::vector<PointMatch> good_points = pointMatches(&random, random.pose(), kNumMatches, 0, 1e-3);
  const RobustOptions options;
  const Eigen::Quaterniond level = Eigen::Quaterniond::Identity();
  const auto motionStatuses = [&](const std::vector<RayMatch>& matches) {
    return std::vector<EstimationStatus>{estimateAckermannMotion(matches, options).status,
                                         estimatePlanarMotion(matches, options).status,
                                         estimateKnownVerticalMotion(matches, level, level, options).status,
                                         refineMotion(matches, truth, options).status};
  };
  const auto poseStatuses = [&](const std::vector<PointMatch>& matches) {
    return std::vector<EstimationStatus>{estimateAbsolutePose(matches, options).status,
                                         estimateUprightPose(matches, level, options).status};
  };
  for (const EstimationStatus status : motionStatuses({good[0]})) {
    EXPECT_EQ(status, EstimationStatus::kTooFewMatches);
  }
  for (const EstimationStatus status : poseStatuses({good_points[0]})) {
    EXPECT_EQ(status, EstimationStatus::kTooFewMatches);
  }
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 0.5}) {
    std::vector<RayMatch> matches = good;
    matches[7].current.direction.y() = bad + 1.0;
    std::vector<PointMatch> points = good_points;
    points[7].ray.direction.z() = bad + 1.0;
    for (const EstimationStatus status : motionStatuses(matches)) {
      EXPECT_EQ(status, EstimationStatus::kNotFinite);
    }
    for (const EstimationStatus status : poseStatuses(points)) {
      EXPECT_EQ(status, EstimationStatus::kNotFinite);
    }
  }
  for (const EstimationStatus status : motionStatuses(rayMatches(&random, truth, 12, 12, 0.0))) {
    EXPECT_EQ(status, EstimationStatus::kNoConsensus);
  }
  for (const EstimationStatus status : poseStatuses(pointMatches(&random, truth, 12, 12, 0.0))) {
    EXPECT_EQ(status, EstimationStatus::kNoConsensus);
  }
  // If all matches are equal, every sample is degenerate.
  for (const EstimationStatus status : poseStatuses(std::vector<PointMatch>(50, good_points[0]))) {
    EXPECT_EQ(status, EstimationStatus::kNoConsensus);
  }
  RobustOptions invalid;
  invalid.confidence = 1.0;
  EXPECT_THROW(estimateAckermannMotion(good, invalid), std::invalid_argument);
  invalid = RobustOptions();
  invalid.max_error_rad = -1.0;
  EXPECT_THROW(estimateAbsolutePose(good_points, invalid), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
