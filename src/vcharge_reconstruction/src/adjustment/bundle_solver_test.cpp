#include "vcharge_reconstruction/bundle_solver.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "adjustment/ceres_bundle.h"
#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

/// A noisy drive with some wrong observations, from disturbed poses and points.
BundleProblem makeProblem(const std::vector<ImageTiming>& timings = {}) {
  testing::TestDriveOptions drive;
  drive.timings = timings;
  drive.noise_px = 0.4;
  drive.odometry_scale = 1.01;
  const ReconstructionData data = testing::makeTestDrive(drive);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 1.0);
  BundleProblem problem;
  problem.rig = data.rig;
  problem.odometer_sigmas = {0.03, 0.05};
  for (size_t i = 0; i < data.keyframes.size(); ++i) {
    Eigen::Vector3d shift;
    for (double& axis : shift) {
      axis = i == 0 ? 0.0 : 0.03 * noise(random);
    }
    const RigidTransform& pose = data.keyframes[i].map_from_vehicle;
    problem.map_from_vehicle.emplace_back(pose.rotation(), pose.translation() + shift);
    if (!timings.empty()) {
      problem.rates.push_back(data.keyframes[i].motion.rates);
    }
    if (i > 0) {
      Eigen::Matrix<double, 6, 1> sigmas;
      sigmas << 0.005, 0.005, 0.02, 0.01, 0.01, 0.002;
      const RigidTransform motion =
          data.keyframes[i - 1].odom_from_vehicle.inverse() * data.keyframes[i].odom_from_vehicle;
      problem.odometer_factors.push_back(
          {static_cast<int32_t>(i), motion, sigmas.cwiseAbs2().cwiseInverse().asDiagonal()});
    }
  }
  for (const Track& track : data.tracks) {
    Eigen::Vector3d shift;
    for (double& axis : shift) {
      axis = 0.05 * noise(random);
    }
    problem.points_in_map.push_back(*track.position_m + shift);
    problem.first_observation.push_back(problem.observations.size());
    for (const TrackObservation& observation : track.observations) {
      const double wrong_px = problem.observations.size() % 17 == 0 ? 25.0 : 0.0;
      problem.observations.push_back({observation.keyframe, observation.camera,
                                      observation.position_px + Eigen::Vector2d(wrong_px, -wrong_px), 0.5});
    }
  }
  problem.first_observation.push_back(problem.observations.size());
  return problem;
}

double largestDifference_m(const BundleProblem& a, const BundleProblem& b) {
  double largest = 0.0;
  for (size_t i = 0; i < a.map_from_vehicle.size(); ++i) {
    largest =
        std::max(largest, (a.map_from_vehicle[i].translation() - b.map_from_vehicle[i].translation()).norm());
  }
  return largest;
}

TEST(BundleSolverTest, TakesTheStepsOfCeres) {
  for (const int iterations : {1, 3, 40}) {
    BundleProblem ours = makeProblem();
    BundleProblem theirs = ours;
    const BundleProblem before = ours;
    const BundleSolution solution = solveBundle(iterations, 1e-9, &ours);
    testing::solveWithCeres(iterations, 1e-9, &theirs);
    EXPECT_GT(largestDifference_m(ours, before), 0.03) << "the problem should not be solved already";
    // Rounding decides which of the last, tiny steps are accepted.
    EXPECT_LT(largestDifference_m(ours, theirs), iterations < 40 ? 1e-9 : 1e-5)
        << iterations << " iterations";
    EXPECT_NEAR(ours.odometer[0], theirs.odometer[0], 1e-6);
    EXPECT_LE(solution.num_iterations, iterations);
  }
}

TEST(BundleSolverTest, AdjustsExtrinsicsAsCeresDoes) {
  BundleProblem ours = makeProblem();
  for (const RigCamera& camera : ours.rig->cameras) {
    const RigidTransform& extrinsics = *camera.vehicle_from_camera;
    ours.vehicle_from_camera.emplace_back(
        rotationFromVector(Eigen::Vector3d(0.004, -0.003, 0.005)) * extrinsics.rotation(),
        extrinsics.translation() + Eigen::Vector3d(0.03, 0.02, -0.02));
  }
  BundleProblem theirs = ours;
  const BundleProblem before = ours;
  solveBundle(3, 1e-9, &ours);
  testing::solveWithCeres(3, 1e-9, &theirs);
  EXPECT_LT(largestDifference_m(ours, theirs), 1e-8);
  for (size_t i = 0; i < ours.vehicle_from_camera.size(); ++i) {
    const RigidTransform& camera = ours.vehicle_from_camera[i];
    EXPECT_GT((camera.translation() - before.vehicle_from_camera[i].translation()).norm(), 0.01);
    EXPECT_LT((camera.translation() - theirs.vehicle_from_camera[i].translation()).norm(), 1e-8);
    EXPECT_LT(angleOfRotation(camera.rotation().conjugate() * theirs.vehicle_from_camera[i].rotation()),
              1e-8);
  }
}

TEST(BundleSolverTest, KeepsExtrinsicsAtACertainPrior) {
  BundleProblem weak = makeProblem();
  for (const RigCamera& camera : weak.rig->cameras) {
    const RigidTransform& extrinsics = *camera.vehicle_from_camera;
    weak.vehicle_from_camera.push_back(extrinsics);
    weak.prior_vehicle_from_camera.emplace_back(
        rotationFromVector(Eigen::Vector3d(0.001, 0.0, -0.002)) * extrinsics.rotation(),
        extrinsics.translation() + Eigen::Vector3d(0.005, 0.0, 0.01));
  }
  BundleProblem none = weak;
  none.prior_vehicle_from_camera.clear();
  BundleProblem certain = weak;
  const auto size = static_cast<Eigen::Index>(6 * weak.vehicle_from_camera.size());
  weak.extrinsics_information = 1e-6 * Eigen::MatrixXd::Identity(size, size);
  certain.extrinsics_information = 1e12 * Eigen::MatrixXd::Identity(size, size);
  solveBundle(40, 1e-9, &none);
  solveBundle(40, 1e-9, &weak);
  solveBundle(40, 1e-9, &certain);
  for (size_t i = 0; i < weak.vehicle_from_camera.size(); ++i) {
    const auto distance_m = [i](const BundleProblem& a, const RigidTransform& b) {
      return (a.vehicle_from_camera[i].translation() - b.translation()).norm();
    };
    EXPECT_LT(distance_m(weak, none.vehicle_from_camera[i]), 1e-4);
    EXPECT_LT(distance_m(certain, certain.prior_vehicle_from_camera[i]), 1e-6);
    EXPECT_LT(angleOfRotation(certain.vehicle_from_camera[i].rotation().conjugate() *
                              certain.prior_vehicle_from_camera[i].rotation()),
              1e-6);
  }
  certain.prior_vehicle_from_camera.pop_back();
  EXPECT_THROW(solveBundle(1, 1e-3, &certain), std::logic_error);
}

/// Cameras whose focal lengths and principal points are not those of the rig's models.
BundleProblem makeProblemOfOtherImages(const ImageDeviation& truth, double sigma) {
  BundleProblem problem = makeProblem();
  auto rig = std::make_shared<CameraRig>(*problem.rig);
  for (RigCamera& camera : rig->cameras) {
    problem.vehicle_from_camera.push_back(*camera.vehicle_from_camera);
    camera.model = camera.model.withImage(std::exp(-truth[0]), -truth.tail<2>());
  }
  problem.rig = rig;
  problem.image_deviations.assign(rig->cameras.size(), ImageDeviation::Zero());
  problem.prior_image_deviations = problem.image_deviations;
  problem.image_deviation_sigmas.assign(rig->cameras.size(), sigma * ImageDeviation(0.01, 3.0, 3.0));
  return problem;
}

TEST(BundleSolverTest, FindsHowImagesDeviateFromTheirModels) {
  const ImageDeviation truth(0.008, 2.0, -1.5);
  BundleProblem problem = makeProblemOfOtherImages(truth, 1.0);
  BundleProblem fixed = problem;
  fixed.image_deviations.clear();
  EXPECT_THROW(solveBundle(1, 1e-3, &fixed), std::logic_error);
  fixed.prior_image_deviations.clear();
  fixed.image_deviation_sigmas.clear();
  const double cost_of_fixed = solveBundle(40, 1e-9, &fixed).cost;
  EXPECT_LT(solveBundle(40, 1e-9, &problem).cost, 0.97 * cost_of_fixed);
  const BundleCovariance uncertainty = bundleCovariance(problem);
  ASSERT_TRUE(uncertainty.is_valid);
  for (size_t i = 0; i < problem.image_deviations.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 + 9 * i + 6);
    const Eigen::Matrix3d covariance = uncertainty.covariance.block<3, 3>(row, row);
    const Eigen::Vector3d error = problem.image_deviations[i] - truth;
    EXPECT_LT(error.dot(covariance.ldlt().solve(error)), 16.0)
        << i << ": " << problem.image_deviations[i].transpose();
    EXPECT_LT(std::sqrt(covariance(0, 0)), 0.003) << "a drive shows the focal length";
  }
}

TEST(BundleSolverTest, EndsWhereNoImageDeviationIsBetter) {
  BundleProblem problem = makeProblemOfOtherImages({0.003, -1.0, 0.5}, 0.5);
  const double least = solveBundle(60, 1e-12, &problem).cost;
  for (size_t i = 0; i < problem.image_deviations.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double step : {-0.1, 0.1}) {
        BundleProblem moved = problem;
        moved.image_deviations[i][axis] += (axis == 0 ? 0.01 : 1.0) * step;
        EXPECT_GT(solveBundle(0, 1e-12, &moved).cost, least) << i << " " << axis << " " << step;
      }
    }
  }
}

TEST(BundleSolverTest, KeepsImagesAtACertainPrior) {
  BundleProblem problem = makeProblemOfOtherImages({0.008, 2.0, -1.5}, 1e-6);
  BundleProblem fixed = problem;
  fixed.image_deviations.clear();
  fixed.prior_image_deviations.clear();
  fixed.image_deviation_sigmas.clear();
  solveBundle(5, 1e-9, &problem);
  solveBundle(5, 1e-9, &fixed);
  EXPECT_LT(largestDifference_m(problem, fixed), 1e-6);
  EXPECT_LT(problem.image_deviations[0].norm(), 1e-6);
}

const std::vector<ImageTiming> kTimings = {{0.025, ReadoutDirection::kDown, 0.006},
                                           {0.018, ReadoutDirection::kUp, -0.006}};

double poseError_m(const BundleProblem& problem) {
  const std::vector<Keyframe> truth = testing::makeTestDrive(testing::TestDriveOptions()).keyframes;
  double squares_m2 = 0.0;
  for (size_t i = 0; i < truth.size(); ++i) {
    squares_m2 +=
        (problem.map_from_vehicle[i].translation() - truth[i].map_from_vehicle.translation()).squaredNorm();
  }
  return std::sqrt(squares_m2 / static_cast<double>(truth.size()));
}

TEST(BundleSolverTest, KnowsWhereTheVehicleWasWhenALineWasExposed) {
  BundleProblem problem = makeProblem(kTimings);
  BundleProblem at_once = problem;
  at_once.rates.clear();
  const double cost = solveBundle(40, 1e-9, &problem).cost;
  EXPECT_LT(cost, 0.995 * solveBundle(40, 1e-9, &at_once).cost);
  EXPECT_LT(poseError_m(problem), 0.02);
  EXPECT_LT(poseError_m(problem), 0.5 * poseError_m(at_once));
}

/// A problem whose rig does not tell the cameras' timing.
BundleProblem makeProblemOfOtherTiming(double sigma_s) {
  BundleProblem problem = makeProblem(kTimings);
  auto rig = std::make_shared<CameraRig>(*problem.rig);
  for (RigCamera& camera : rig->cameras) {
    problem.vehicle_from_camera.push_back(*camera.vehicle_from_camera);
    camera.timing.readout_s = camera.timing.clock_offset_s = 0.0;
  }
  problem.rig = rig;
  problem.timing_deviations.assign(rig->cameras.size(), TimingDeviation::Zero());
  problem.prior_timing_deviations = problem.timing_deviations;
  problem.timing_deviation_sigmas.assign(rig->cameras.size(), TimingDeviation::Constant(sigma_s));
  return problem;
}

TEST(BundleSolverTest, FindsReadoutTimesAndClockOffsets) {
  BundleProblem problem = makeProblemOfOtherTiming(0.1);
  BundleProblem without_rates = problem;
  without_rates.rates.clear();
  EXPECT_THROW(solveBundle(1, 1e-3, &without_rates), std::logic_error);
  solveBundle(40, 1e-9, &problem);
  const BundleCovariance uncertainty = bundleCovariance(problem);
  ASSERT_TRUE(uncertainty.is_valid);
  for (size_t i = 0; i < problem.timing_deviations.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 + 8 * i + 6);
    const Eigen::Matrix2d covariance = uncertainty.covariance.block<2, 2>(row, row);
    const TimingDeviation error =
        problem.timing_deviations[i] - TimingDeviation(kTimings[i].readout_s, kTimings[i].clock_offset_s);
    EXPECT_LT(error.dot(covariance.ldlt().solve(error)), 16.0)
        << i << ": " << problem.timing_deviations[i].transpose();
    EXPECT_LT(std::sqrt(covariance(0, 0)), 0.004) << "a drive shows the readout time";
  }
}

TEST(BundleSolverTest, EndsWhereNoTimingIsBetter) {
  BundleProblem problem = makeProblemOfOtherTiming(0.1);
  const double least = solveBundle(60, 1e-12, &problem).cost;
  for (size_t i = 0; i < problem.timing_deviations.size(); ++i) {
    for (int axis = 0; axis < 2; ++axis) {
      for (const double step_s : {-0.0005, 0.0005}) {
        BundleProblem moved = problem;
        moved.timing_deviations[i][axis] += step_s;
        EXPECT_GT(solveBundle(0, 1e-12, &moved).cost, least) << i << " " << axis << " " << step_s;
      }
    }
  }
}

TEST(BundleSolverTest, UsesPriorsOfPointsAsCeresDoes) {
  BundleProblem ours = makeProblem();
  Eigen::Matrix3d information;
  information << 400.0, 50.0, -20.0, 50.0, 900.0, 30.0, -20.0, 30.0, 200.0;
  ours.point_information.assign(ours.points_in_map.size(), information);
  BundleProblem theirs = ours;
  const BundleProblem before = ours;
  solveBundle(3, 1e-9, &ours);
  testing::solveWithCeres(3, 1e-9, &theirs);
  EXPECT_GT(largestDifference_m(ours, before), 0.03);
  EXPECT_LT(largestDifference_m(ours, theirs), 1e-8);
  for (size_t i = 0; i < ours.points_in_map.size(); ++i) {
    ASSERT_LT((ours.points_in_map[i] - theirs.points_in_map[i]).norm(), 1e-7) << i;
  }
  BundleProblem fixed = before;
  fixed.point_information.assign(fixed.points_in_map.size(), 1e12 * Eigen::Matrix3d::Identity());
  solveBundle(10, 1e-9, &fixed);
  for (size_t i = 0; i < fixed.points_in_map.size(); ++i) {
    ASSERT_LT((fixed.points_in_map[i] - before.points_in_map[i]).norm(), 1e-5) << i;
  }
}

TEST(BundleSolverTest, MovesGroundPointsToTheGround) {
  // Adds one point that no camera sees, with a ground observation.
  BundleProblem problem = makeProblem();
  problem.points_in_map = {problem.map_from_vehicle[3] * Eigen::Vector3d(1.0, 2.0, 0.3)};
  problem.observations.clear();
  problem.first_observation = {0, 0};
  problem.ground_observations = {{0, 3, 1e-3}};
  problem.loss_sigmas = 1e6;
  solveBundle(30, 1e-12, &problem);
  EXPECT_NEAR((problem.map_from_vehicle[3].inverse() * problem.points_in_map[0]).z(), 0.0, 1e-4);
}

TEST(BundleSolverTest, GivesTheSameBitsOnOneThread) {
  BundleProblem parallel = makeProblem();
  BundleProblem serial = parallel;
  const BundleSolution of_parallel = solveBundle(10, 1e-9, &parallel);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const BundleSolution of_serial = solveBundle(10, 1e-9, &serial);
  EXPECT_EQ(largestDifference_m(parallel, serial), 0.0);
  EXPECT_EQ(of_parallel.cost, of_serial.cost);
  EXPECT_EQ(parallel.points_in_map, serial.points_in_map);
}

TEST(BundleSolverTest, KeepsUnobservedPoints) {
  BundleProblem problem = makeProblem();
  auto rig = std::make_shared<CameraRig>(*problem.rig);
  rig->cameras[0].model = MeiCamera(1.2, 400.0, 400.0, 320.0, 200.0);
  problem.rig = rig;
  const RigidTransform map_from_camera =
      problem.map_from_vehicle.front() * *problem.rig->cameras[0].vehicle_from_camera;
  const Eigen::Vector3d unobserved(1.0, 2.0, 3.0);
  const Eigen::Vector3d behind = map_from_camera * Eigen::Vector3d(0.0, 0.0, -30.0);
  problem.points_in_map = {unobserved, behind};
  problem.observations = {{0, 0, Eigen::Vector2d(330.0, 210.0), 0.5}};
  problem.first_observation = {0, 0, 1};
  const BundleSolution solution = solveBundle(10, 1e-6, &problem);
  EXPECT_TRUE(std::isfinite(solution.cost));
  EXPECT_LT((problem.points_in_map[0] - unobserved).norm(), 1e-9);
  EXPECT_LT((problem.points_in_map[1] - behind).norm(), 1e-9);
  for (const RigidTransform& pose : problem.map_from_vehicle) {
    EXPECT_TRUE(pose.translation().allFinite());
  }
}

TEST(BundleSolverTest, RefusesUngroupedObservations) {
  BundleProblem problem = makeProblem();
  problem.first_observation.pop_back();
  EXPECT_THROW(solveBundle(1, 1e-3, &problem), std::logic_error);
}

}  // namespace
}  // namespace vcharge
