#include "vcharge_ros/rig_health_conversions.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

class RigHealthConversionsTest : public ::testing::Test {
 protected:
  RigHealthConversionsTest() {
    for (RigCamera& camera : rig_.cameras) {
      camera.covariance = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
      vcharge_msgs::CameraHealth health;
      health.camera = camera.name;
      health.vehicle_from_camera = toTransformMessage(*camera.vehicle_from_camera);
      message_.cameras.push_back(health);
    }
  }
  CameraRig rig_ = testing::makeRig();
  vcharge_msgs::RigHealth message_;
};

TEST_F(RigHealthConversionsTest, ACameraThatMovedHasItsDeviation) {
  vcharge_msgs::CameraHealth& left = message_.cameras[1];
  left.state = left.MOVED;
  left.deviation = {0.0, 0.03, 0.0, 0.0, 0.0, 0.02};
  left.standard_deviations = {0.0, 0.0, 0.04, 0.0, 0.0, 0.0};
  const auto condition = fromMessage(message_, rig_);
  ASSERT_TRUE(condition.has_value());
  EXPECT_FALSE((*condition)[0].has_moved);
  EXPECT_NEAR((*condition)[0].position_sigma_m, 1e-3, 1e-12);
  EXPECT_TRUE((*condition)[1].has_moved);
  EXPECT_NEAR((*condition)[1].position_sigma_m, 0.05 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR((*condition)[1].rotation_sigma_rad, 0.02 / std::sqrt(3.0), 1e-12);
}

TEST_F(RigHealthConversionsTest, ACameraThatSeesLittleIsWhereItWas) {
  message_.cameras[0].state = vcharge_msgs::CameraHealth::SEES_LITTLE;
  EXPECT_EQ(fromMessage(message_, rig_), conditionAsCalibrated(rig_));
}

TEST_F(RigHealthConversionsTest, AMessageAboutOtherExtrinsicsSaysNothing) {
  rig_.cameras[0].vehicle_from_camera = RigidTransform::planar(3.001, 0.0, 0.3);
  EXPECT_FALSE(fromMessage(message_, rig_).has_value());
}

TEST_F(RigHealthConversionsTest, BadMessagesAreRefused) {
  vcharge_msgs::RigHealth other = message_;
  other.cameras[0].camera = "roof";
  EXPECT_THROW(fromMessage(other, rig_), InputError);
  other = message_;
  other.cameras.pop_back();
  EXPECT_THROW(fromMessage(other, rig_), InputError);
  other = message_;
  other.cameras[0].state = vcharge_msgs::CameraHealth::MOVED;
  other.cameras[0].deviation[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fromMessage(other, rig_), InputError);
}

}  // namespace
}  // namespace vcharge
