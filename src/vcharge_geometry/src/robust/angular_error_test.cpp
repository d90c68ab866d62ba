#include "vcharge_geometry/robust/angular_error.h"

#include <cmath>

#include <gtest/gtest.h>

#include "solvers/random_problems.h"

namespace vcharge {
namespace {

/// Applies R = Exp(dphi) R_hat, t = t_hat + dt, the convention of covariances.
RotationTranslation moved(const RotationTranslation& model, int parameter, double step) {
  RotationTranslation result = model;
  Eigen::Vector3d change = Eigen::Vector3d::Zero();
  change[parameter % 3] = step;
  if (parameter < 3) {
    result.translation_m += change;
  } else {
    result.rotation = rotationFromVector(change).toRotationMatrix() * model.rotation;
  }
  return result;
}

RayMatch randomRayMatch(RandomProblems* random, const RigidTransform& previous_from_current,
                        double sigma_rad) {
  RayMatch match;
  match.previous_camera = random->integer(4);
  match.current_camera = random->integer(4);
  const Eigen::Vector3d point = random->point();
  match.previous = random->disturbed(RandomProblems::rayTo(point, match.previous_camera), sigma_rad);
  match.current = random->disturbed(
      RandomProblems::rayTo(previous_from_current.inverse() * point, match.current_camera), sigma_rad);
  return match;
}

TEST(AngularErrorTest, EpipolarJacobianIsTheDerivative) {
  RandomProblems random(1);
  for (int i = 0; i < 200; ++i) {
    const RigidTransform truth(random.rotation(1.0), random.direction());
    const RayMatch match = randomRayMatch(&random, truth, 0.05);
    const RotationTranslation model(truth);
    Eigen::Matrix<double, 1, 6> jacobian;
    const double error =
        epipolarAngleWithJacobian(EpipolarGeometry(match, model), match.previous.direction, &jacobian);
    EXPECT_NEAR(error, epipolarAngle(EpipolarGeometry(match, model)), 1e-14);
    for (int k = 0; k < 6; ++k) {
      constexpr double kStep = 1e-6;
      const double numeric = (epipolarAngle(EpipolarGeometry(match, moved(model, k, kStep))) -
                              epipolarAngle(EpipolarGeometry(match, moved(model, k, -kStep)))) /
                             (2.0 * kStep);
      EXPECT_NEAR(jacobian[k], numeric, 1e-6 * (1.0 + std::abs(numeric))) << k;
    }
  }
}

TEST(AngularErrorTest, PointingJacobianIsTheDerivative) {
  RandomProblems random(2);
  for (int i = 0; i < 200; ++i) {
    const RigidTransform truth = random.pose();
    PointMatch match = random.pointMatches<1>(truth)[0];
    match.ray = random.disturbed(match.ray, 0.05);
    const RotationTranslation model(truth);
    Eigen::Matrix<double, 3, 6> jacobian;
    const Eigen::Vector3d error = pointingError(match, model, &jacobian);
    EXPECT_NEAR(error.squaredNorm(), squaredPointingError(match, model), 1e-14);
    for (int k = 0; k < 6; ++k) {
      constexpr double kStep = 1e-6;
      const Eigen::Vector3d numeric =
          (pointingError(match, moved(model, k, kStep)) - pointingError(match, moved(model, k, -kStep))) /
          (2.0 * kStep);
      EXPECT_LE((jacobian.col(k) - numeric).norm(), 1e-6 * (1.0 + numeric.norm())) << k;
    }
  }
}

TEST(AngularErrorTest, ErrorsHaveTheDeviationOfARay) {
  RandomProblems random(3);
  constexpr double kSigma = 1e-3;
  constexpr int kNum = 20000;
  double epipolar = 0.0;
  double pointing = 0.0;
  for (int i = 0; i < kNum; ++i) {
    const RigidTransform motion(random.rotation(0.3), 2.0 * random.direction());
    epipolar +=
        squaredEpipolarAngle(randomRayMatch(&random, motion, kSigma), RotationTranslation(motion), 0.1);
    const RigidTransform pose = random.pose();
    pointing += squaredPointingError(random.pointMatches<1>(pose, 1.0, kSigma)[0], RotationTranslation(pose));
  }
  // The errors have one and two components; the deviation of a mean of squares is sqrt(2 / n), times 5.
  EXPECT_NEAR(epipolar / kNum / (kSigma * kSigma), 1.0, 5.0 * std::sqrt(2.0 / kNum));
  EXPECT_NEAR(pointing / kNum / (2.0 * kSigma * kSigma), 1.0, 5.0 * std::sqrt(2.0 / kNum));
}

TEST(AngularErrorTest, PointsBehindTheCameraAreOutliers) {
  const Eigen::Vector3d point(5.0, 1.0, 0.0);
  RayMatch match;
  match.previous = {Eigen::Vector3d::Zero(), point.normalized()};
  match.current = {Eigen::Vector3d::Zero(), (point - Eigen::Vector3d(1.0, 0.0, 0.0)).normalized()};
  const RotationTranslation forward(RigidTransform::planar(1.0, 0.0, 0.0));
  const RotationTranslation backward(RigidTransform::planar(-1.0, 0.0, 0.0));
  EXPECT_NEAR(squaredEpipolarAngle(match, forward, 0.005), 0.0, 1e-20);
  EXPECT_EQ(squaredEpipolarAngle(match, backward, 0.005), INFINITY);
  const PointMatch behind{match.previous, -point};
  EXPECT_EQ(squaredPointingError(behind, RotationTranslation()), INFINITY);
}

TEST(AngularErrorTest, WithoutBaselineRaysMustBeParallel) {
  RayMatch match;
  match.previous = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()};
  match.current = {Eigen::Vector3d::Zero(), Eigen::Vector3d(1.0, 0.01, 0.0).normalized()};
  EXPECT_NEAR(squaredEpipolarAngle(match, RotationTranslation(), 0.005), 0.5e-4, 1e-8);
}

}  // namespace
}  // namespace vcharge
