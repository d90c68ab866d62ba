#include "vcharge_core/motion/vehicle_rates.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(VehicleRatesTest, ConstantSpeedAndTurnRateFollowAnArc) {
  const VehicleRates rates{2.0, 0.5};
  const RigidTransform motion = rates.motionAfter(M_PI);  // a quarter of a circle of 4 m
  EXPECT_LT((motion.translation() - Eigen::Vector3d(4.0, 4.0, 0.0)).norm(), 1e-12);
  EXPECT_NEAR(yawOfRotation(motion.rotation()), 0.5 * M_PI, 1e-12);
  const RigidTransform there_and_back = rates.motionAfter(0.3) * rates.motionAfter(-0.3);
  EXPECT_LT(there_and_back.translation().norm(), 1e-12);
  EXPECT_LT((VehicleRates{3.0, 0.0}.motionAfter(-0.1).translation() - Eigen::Vector3d(-0.3, 0.0, 0.0)).norm(),
            1e-12);
}

TEST(VehicleRatesTest, VelocityIsTheDerivativeOfTheMotion) {
  const VehicleRates rates{2.0, -0.6};
  const Eigen::Vector3d point_m(1.0, 2.0, 0.5);
  constexpr double kStep_s = 1e-5;
  const Eigen::Vector3d change =
      (rates.motionAfter(kStep_s) * point_m - rates.motionAfter(-kStep_s) * point_m) / (2.0 * kStep_s);
  EXPECT_LT((rates.velocityOf(point_m) - change).norm(), 1e-8);
}

}  // namespace
}  // namespace vcharge
