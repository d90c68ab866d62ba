#include "vcharge_ros/conversions.h"

#include <limits>

#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::expectInputError;

RigidTransform someTransform() {
  return RigidTransform(rotationFromYawPitchRoll(0.7, -0.2, 0.1), Eigen::Vector3d(1.0, -2.0, 0.5));
}

TEST(ConversionsTest, KeepsStampsToTheNanosecond) {
  for (const int64_t ns :
       {int64_t{1}, int64_t{999999999}, int64_t{1342626148354042017}, int64_t{4294967295999999999}}) {
    const Timestamp stamp = Timestamp::fromNanoseconds(ns);
    EXPECT_EQ(toTimestamp(fromTimestamp(stamp)), stamp);
  }
  EXPECT_EQ(fromTimestamp(Timestamp::fromNanoseconds(1500000003)), ros::Time(1, 500000003));
}

TEST(ConversionsTest, RefusesStampsThatRosTimeCannotHold) {
  EXPECT_THROW(fromTimestamp(Timestamp::fromNanoseconds(-1)), std::out_of_range);
  EXPECT_THROW(fromTimestamp(Timestamp::fromNanoseconds(4294967296000000000)), std::out_of_range);
}

TEST(ConversionsTest, KeepsTransformsAndMovesPointsAlike) {
  const RigidTransform target_from_source = someTransform();
  const Eigen::Vector3d point(0.3, -4.0, 2.0);
  for (const RigidTransform& read : {fromMessage(toPoseMessage(target_from_source), "pose"),
                                     fromMessage(toTransformMessage(target_from_source), "transform")}) {
    EXPECT_LT((read * point - target_from_source * point).norm(), 1e-14);
  }
  const auto stamped = toTransformStamped(target_from_source, testing::milliseconds(7), "odom", "base_link");
  EXPECT_EQ(stamped.header.frame_id, "odom");
  EXPECT_EQ(stamped.child_frame_id, "base_link");
  EXPECT_EQ(toTimestamp(stamped.header.stamp), testing::milliseconds(7));
  EXPECT_EQ(stamped.transform.translation.y, -2.0);
}

TEST(ConversionsTest, NamesTheSourceOfABadPose) {
  geometry_msgs::Pose pose = toPoseMessage(someTransform());
  pose.orientation.w += 0.1;
  expectInputError([&] { fromMessage(pose, "/odom"); }, {"/odom", "norm 1"});
  pose = geometry_msgs::Pose();  // all zero: a publisher that did not set the orientation
  expectInputError([&] { fromMessage(pose, "/odom"); }, {"/odom", "norm 0"});
  pose = toPoseMessage(someTransform());
  pose.position.z = std::numeric_limits<double>::quiet_NaN();
  expectInputError([&] { fromMessage(pose, "/odom"); }, {"/odom", "finite position"});
  pose = toPoseMessage(someTransform());
  pose.orientation.x = std::numeric_limits<double>::quiet_NaN();
  expectInputError([&] { fromMessage(pose, "/odom"); }, {"/odom", "norm"});
}

TEST(ConversionsTest, KeepsOdometry) {
  const VehicleOdometry odometry{testing::milliseconds(20), someTransform(), 1.25, -0.5};
  const nav_msgs::Odometry message = toMessage(odometry, "odom", "base_link");
  EXPECT_EQ(message.header.frame_id, "odom");
  EXPECT_EQ(message.child_frame_id, "base_link");
  const VehicleOdometry read = fromMessage(message, "/odom", "base_link");
  EXPECT_EQ(read.stamp, odometry.stamp);
  EXPECT_EQ(read.forward_speed_m_per_s, 1.25);
  EXPECT_EQ(read.yaw_rate_rad_per_s, -0.5);
  EXPECT_LT((read.odom_from_vehicle.matrix() - odometry.odom_from_vehicle.matrix()).norm(), 1e-14);
}

TEST(ConversionsTest, RefusesOdometryOfAnotherFrameOrWithoutVelocity) {
  nav_msgs::Odometry message =
      toMessage({testing::milliseconds(20), someTransform(), 1.0, 0.0}, "odom", "imu_link");
  expectInputError([&] { fromMessage(message, "/odom", "base_link"); },
                   {"/odom", "child_frame_id 'base_link'", "imu_link"});
  message.child_frame_id.clear();
  EXPECT_NO_THROW(fromMessage(message, "/odom", "base_link"));
  message.twist.twist.linear.x = std::numeric_limits<double>::infinity();
  expectInputError([&] { fromMessage(message, "/odom", "base_link"); }, {"/odom", "twist.linear.x"});
}

TEST(ConversionsTest, KeepsWheelTicks) {
  const WheelTicks ticks{testing::milliseconds(30), -5, int64_t{1} << 40, 0.01, -0.3};
  const WheelTicks read = fromMessage(toMessage(ticks, "base_link"), "/wheel_ticks");
  EXPECT_EQ(read.stamp, ticks.stamp);
  EXPECT_EQ(read.left_ticks, -5);
  EXPECT_EQ(read.right_ticks, int64_t{1} << 40);
  EXPECT_EQ(read.metres_per_tick, 0.01);
  EXPECT_EQ(read.steering_angle_rad, -0.3);
}

TEST(ConversionsTest, RefusesWheelTicksWithoutScale) {
  vcharge_msgs::WheelTicks message;
  expectInputError([&] { fromMessage(message, "/wheel_ticks"); }, {"/wheel_ticks", "metres_per_tick"});
}

}  // namespace
}  // namespace vcharge
