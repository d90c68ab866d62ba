#include "vcharge_core/motion/rigid_transform.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

RigidTransform randomTransform(std::mt19937* generator) {
  std::normal_distribution<double> normal;
  const auto next = [&] { return normal(*generator); };
  return RigidTransform(Eigen::Quaterniond(next(), next(), next(), next()),
                        Eigen::Vector3d(next(), next(), next()));
}

void expectNear(const RigidTransform& a, const RigidTransform& b, double tolerance) {
  EXPECT_LE((a.matrix() - b.matrix()).norm(), tolerance);
}

TEST(RigidTransformTest, FormsAGroupThatActsOnPoints) {
  std::mt19937 generator(1);
  for (int i = 0; i < 100; ++i) {
    const RigidTransform a_from_b = randomTransform(&generator);
    const RigidTransform b_from_c = randomTransform(&generator);
    const RigidTransform c_from_d = randomTransform(&generator);
    const Eigen::Vector3d point_in_c = randomTransform(&generator).translation();
    EXPECT_LE(((a_from_b * b_from_c) * point_in_c - a_from_b * (b_from_c * point_in_c)).norm(), 1e-12);
    expectNear((a_from_b * b_from_c) * c_from_d, a_from_b * (b_from_c * c_from_d), 1e-12);
    expectNear(a_from_b * a_from_b.inverse(), RigidTransform(), 1e-12);
    expectNear(RigidTransform::fromMatrix(a_from_b.matrix()), a_from_b, 1e-12);
    EXPECT_NEAR(a_from_b.rotation().norm(), 1.0, 1e-14);
  }
}

TEST(RigidTransformTest, RotationVectorsSurviveExponentialAndBack) {
  for (const double angle : {0.0, 1e-12, 1e-7, 1e-3, 1.0, 3.0, 3.14159}) {
    const Eigen::Vector3d vector = angle * Eigen::Vector3d(1.0, -2.0, 2.0) / 3.0;
    const Eigen::Quaterniond rotation = rotationFromVector(vector);
    EXPECT_LE((vectorFromRotation(rotation) - vector).norm(), 1e-12) << angle;
    EXPECT_LE((vectorFromRotation(Eigen::Quaterniond(-rotation.coeffs())) - vector).norm(), 1e-12) << angle;
    EXPECT_NEAR(angleOfRotation(rotation), angle, 1e-12);
    EXPECT_LE((rotation.toRotationMatrix() -
               Eigen::AngleAxisd(angle, Eigen::Vector3d(1.0, -2.0, 2.0) / 3.0).toRotationMatrix())
                  .norm(),
              1e-12);
  }
}

TEST(RigidTransformTest, YawPitchRollTurnInThatOrder) {
  const Eigen::Quaterniond rotation = rotationFromYawPitchRoll(M_PI / 2, 0.0, 0.0);
  EXPECT_LE((rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  // Positive pitch lowers the nose (x forward, z up).
  EXPECT_LT((rotationFromYawPitchRoll(0.0, 0.1, 0.0) * Eigen::Vector3d::UnitX()).z(), 0.0);
  // Positive roll raises the left side.
  EXPECT_GT((rotationFromYawPitchRoll(0.0, 0.0, 0.1) * Eigen::Vector3d::UnitY()).z(), 0.0);
  EXPECT_NEAR(yawOfRotation(rotationFromYawPitchRoll(-2.5, 0.2, -0.1)), -2.5, 1e-12);
}

TEST(RigidTransformTest, InterpolatesAlongTheShortWay) {
  const RigidTransform from = RigidTransform::planar(0.0, 0.0, 3.0);
  const RigidTransform to = RigidTransform::planar(2.0, 4.0, -3.0);
  expectNear(interpolate(from, to, 0.0), from, 1e-12);
  expectNear(interpolate(from, to, 1.0), to, 1e-12);
  expectNear(interpolate(from, to, 0.5), RigidTransform::planar(1.0, 2.0, M_PI), 1e-12);
}

TEST(RigidTransformTest, TakesAUnitQuaternionAsItIs) {
  // Normalizing such quaternions again would change their last bits.
  for (int i = 0; i < 1000; ++i) {
    const RigidTransform product = RigidTransform(rotationFromYawPitchRoll(0.1 * i, 0.03 * i, -0.7 * i),
                                                  Eigen::Vector3d(i, 1.0 / 3.0, -0.0));
    const RigidTransform kept = RigidTransform::fromUnit(product.rotation(), product.translation());
    ASSERT_EQ(kept.rotation().coeffs(), product.rotation().coeffs());
    ASSERT_EQ(kept.translation(), product.translation());
  }
  EXPECT_THROW(RigidTransform::fromUnit(Eigen::Quaterniond(1.001, 0, 0, 0), Eigen::Vector3d::Zero()),
               std::logic_error);
}

TEST(RigidTransformTest, RefusesWhatIsNoTransform) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(RigidTransform(Eigen::Quaterniond(0, 0, 0, 0), Eigen::Vector3d::Zero()), std::logic_error);
  EXPECT_THROW(RigidTransform(Eigen::Quaterniond(nan, 0, 0, 0), Eigen::Vector3d::Zero()), std::logic_error);
  EXPECT_THROW(RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, nan, 0)), std::logic_error);
}

}  // namespace
}  // namespace vcharge
