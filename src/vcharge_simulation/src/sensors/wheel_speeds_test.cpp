#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <random>

#include <Eigen/Eigenvalues>

#include "vcharge_simulation/vehicle/vehicle_motion.h"
#include "vcharge_wheel_odometry/wheel_odometry.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr int kPeriod_ms = 20;
constexpr int kSteeringLag_ms = 50;
constexpr double kSpeedStep_m_per_s = 0.01;

const Timestamp kStart = Timestamp::fromNanoseconds(1700000000000000000);

using Change = std::function<void(double time_s, WheelSpeeds*)>;

/// A round with curves to both sides, a start and a stop.
VehicleMotion drive(double cruise_speed_m_per_s) {
  VehicleMotionOptions options;
  options.cruise_speed_m_per_s = cruise_speed_m_per_s;
  options.standstill_s = 2.0;
  options.stop_at_end = true;
  options.duration_s = 120.0;
  return {DrivePath::throughWaypoints(
              {{0, 0}, {40, 0}, {40, 25}, {60, 25}, {60, 50}, {20, 50}, {20, 30}, {0, 30}}, true, 6.0, 3.0),
          options, 3};
}

double quantized(double speed_m_per_s) {
  return kSpeedStep_m_per_s * std::round(speed_m_per_s / kSpeedStep_m_per_s);
}

/// Speeds of all wheels of a car with the default track width and wheelbase. The steering angle lags.
WheelSpeeds speedsAt(const VehicleMotion& motion, int ms) {
  const WheelOdometryOptions car;
  const MotionSample& now = motion.at(ms);
  const double yaw_rate = now.speed_m_per_s * now.curvature_per_m;
  const double left = now.speed_m_per_s - 0.5 * car.track_width_m * yaw_rate;
  const double right = now.speed_m_per_s + 0.5 * car.track_width_m * yaw_rate;
  const double sideways = yaw_rate * car.wheelbase_m;  // of the front axle
  const double sign = now.speed_m_per_s < 0.0 ? -1.0 : 1.0;
  WheelSpeeds speeds;
  speeds.stamp = kStart + std::chrono::milliseconds(ms);
  speeds.rear_left_m_per_s = quantized(left);
  speeds.rear_right_m_per_s = quantized(right);
  speeds.front_left_m_per_s = quantized(sign * std::hypot(left, sideways));
  speeds.front_right_m_per_s = quantized(sign * std::hypot(right, sideways));
  speeds.steering_angle_rad =
      std::atan(motion.at(std::max(0, ms - kSteeringLag_ms)).curvature_per_m * car.wheelbase_m);
  return speeds;
}

struct Outcome {
  double position_m = 0.0;  // largest errors
  double yaw_deg = 0.0;
  double end_position_m = 0.0;
  double length_m = 0.0;
  WheelOdometryCounts counts;
};

Outcome run(const VehicleMotion& motion, const Change& change,
            const WheelOdometryOptions& options = WheelOdometryOptions()) {
  WheelOdometry odometry(options);
  Outcome outcome;
  const RigidTransform world_from_start = motion.at(0).world_from_planar;
  for (int ms = 0; ms < static_cast<int>(motion.duration() * 1000.0) - 100; ms += kPeriod_ms) {
    WheelSpeeds speeds = speedsAt(motion, ms);
    change(1e-3 * ms, &speeds);
    if (speeds.stamp == Timestamp()) {
      continue;  // the message is missing
    }
    const auto estimate = odometry.add(speeds);
    const RigidTransform truth = world_from_start.inverse() * motion.at(ms).world_from_planar;
    const RigidTransform error = truth.inverse() * estimate->odometry.odom_from_vehicle;
    outcome.end_position_m = error.translation().norm();
    outcome.position_m = std::max(outcome.position_m, outcome.end_position_m);
    outcome.yaw_deg = std::max(outcome.yaw_deg, std::abs(yawOfRotation(error.rotation())) * kDegrees);
    EXPECT_GE(estimate->pose_covariance.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-9);
  }
  outcome.length_m = 0.5 * (motion.at(static_cast<int>(motion.duration() * 1000.0) - 100).left_wheel_m +
                            motion.at(static_cast<int>(motion.duration() * 1000.0) - 100).right_wheel_m);
  outcome.counts = odometry.counts();
  std::cout << "position within " << outcome.position_m << " m of " << outcome.length_m << " m, yaw within "
            << outcome.yaw_deg << " deg, " << outcome.counts.slips << " slips\n";
  return outcome;
}

void unchanged(double /*time_s*/, WheelSpeeds* /*speeds*/) {}
void withoutFront(double /*time_s*/, WheelSpeeds* speeds) {
  speeds->front_left_m_per_s = speeds->front_right_m_per_s = WheelSpeeds::kUnknown;
}
void withoutSteering(double /*time_s*/, WheelSpeeds* speeds) {
  speeds->steering_angle_rad = WheelSpeeds::kUnknown;
}

// Speeds in steps of 0.01 m/s are wrong by 3 mm/s; over a minute of 50 messages a second this is 3 mm of each
// wheel, with correlated roundings at constant speed up to 5 mm in each second.
TEST(WheelSpeedsTest, DrivesAreRightWithTwoOrFourWheelsWithOrWithoutSteering) {
  for (const double speed_m_per_s : {1.0, 2.5, 6.0}) {
    const VehicleMotion motion = drive(speed_m_per_s);
    for (const Change& change : {Change(unchanged), Change(withoutFront), Change(withoutSteering),
                                 Change([](double time_s, WheelSpeeds*speeds) {
                                   withoutFront(time_s, speeds);
                                   withoutSteering(time_s, speeds);
                                 })}) {
      const Outcome outcome = run(motion, change);
      EXPECT_GT(outcome.length_m, 80.0);
      EXPECT_LE(outcome.position_m, 0.005 * outcome.length_m);
      EXPECT_LE(outcome.yaw_deg, 1.0);
      EXPECT_EQ(outcome.counts.slips, 0u);
    }
  }
}

TEST(WheelSpeedsTest, StandsStillToTheLastBitAndStartsAgain) {
  WheelOdometry odometry((WheelOdometryOptions()));
  std::optional<RigidTransform> pose;
  for (int i = 0; i < 400; ++i) {
    const bool moves = i < 100 || i >= 300;
    WheelSpeeds speeds;
    speeds.stamp = kStart + std::chrono::milliseconds(20 * i);
    // A speed of a big offset: zero up to the rounding of the arithmetic.
    speeds.rear_left_m_per_s = speeds.rear_right_m_per_s = moves ? 2.0 : 6767 * (0.01 / 3.6) - 67.67 / 3.6;
    speeds.steering_angle_rad = i < 150 || i >= 290 ? 0.0 : 0.3;  // turned while it stands
    const auto estimate = odometry.add(speeds);
    if (i == 120) {
      pose = estimate->odometry.odom_from_vehicle;
      EXPECT_NEAR(pose->translation().x(), 99 * 0.04 + 0.02, 0.01);
    }
    if (i > 120 && i < 300) {
      ASSERT_EQ(estimate->odometry.odom_from_vehicle.matrix(), pose->matrix());
      ASSERT_EQ(estimate->odometry.forward_speed_m_per_s, 0.0);
      ASSERT_TRUE(odometry.counts().standing);
    }
    if (i == 399) {
      EXPECT_NEAR((pose->inverse() * estimate->odometry.odom_from_vehicle).translation().x(), 99.5 * 0.04,
                  0.01);
    }
  }
}

TEST(WheelSpeedsTest, ASlippingRearWheelIsReplacedByTheFrontWheelOnItsSide) {
  const VehicleMotion motion = drive(2.5);
  for (const double factor : {0.0, 1.5}) {  // locked, spinning
    const Change slip = [factor](double time_s, WheelSpeeds* speeds) {
      speeds->rear_left_m_per_s *= time_s > 10.0 && time_s < 12.0 ? factor : 1.0;
    };
    const Outcome outcome = run(motion, slip);
    EXPECT_GE(outcome.counts.slips, 1u);
    EXPECT_FALSE(outcome.counts.slipping);
    EXPECT_LE(outcome.yaw_deg, 3.0);
    WheelOdometryOptions blind;
    blind.slip_yaw_rad = 1e6;
    EXPECT_GE(run(motion, slip, blind).yaw_deg, 10.0 * outcome.yaw_deg);
  }
}

TEST(WheelSpeedsTest, BothRearWheelsMayLock) {
  const VehicleMotion motion = drive(2.5);
  const Outcome outcome = run(motion, [](double time_s, WheelSpeeds* speeds) {
    if (time_s > 10.0 && time_s < 11.0) {
      speeds->rear_left_m_per_s = speeds->rear_right_m_per_s = 0.0;
    }
  });
  EXPECT_GE(outcome.counts.slips, 1u);
  EXPECT_LE(outcome.yaw_deg, 3.0);
  EXPECT_LE(outcome.position_m, 1.0);
}

TEST(WheelSpeedsTest, ASpinningFrontWheelChangesNothing) {
  const VehicleMotion motion = drive(2.5);
  const Outcome outcome = run(motion, [](double time_s, WheelSpeeds* speeds) {
    speeds->front_left_m_per_s *= time_s > 10.0 && time_s < 12.0 ? 2.0 : 1.0;
  });
  EXPECT_EQ(outcome.counts.slips, 0u);
  EXPECT_LE(outcome.yaw_deg, 1.0);
}

TEST(WheelSpeedsTest, WithoutFrontWheelsTheSteeringTellsOfASlip) {
  const VehicleMotion motion = drive(2.5);
  const Outcome outcome = run(motion, [](double time_s, WheelSpeeds* speeds) {
    withoutFront(time_s, speeds);
    speeds->rear_left_m_per_s *= time_s > 10.0 && time_s < 12.0 ? 1.5 : 1.0;
  });
  EXPECT_GE(outcome.counts.slips, 1u);
  EXPECT_LE(outcome.yaw_deg, 5.0);
}

TEST(WheelSpeedsTest, UndersteerInAFastBendIsNoSlip) {
  // 25 m/s on a bend of 400 m radius: the car turns by less than half of what is steered.
  WheelOdometry odometry((WheelOdometryOptions()));
  const WheelOdometryOptions car;
  std::optional<OdometryEstimate> estimate;
  constexpr double kYawRate = 25.0 / 400.0;
  for (int i = 0; i <= 500; ++i) {
    WheelSpeeds speeds;
    speeds.stamp = kStart + std::chrono::milliseconds(20 * i);
    speeds.rear_left_m_per_s = quantized(25.0 - 0.5 * car.track_width_m * kYawRate);
    speeds.rear_right_m_per_s = quantized(25.0 + 0.5 * car.track_width_m * kYawRate);
    speeds.steering_angle_rad = 2.4 * car.wheelbase_m / 400.0;
    estimate = odometry.add(speeds);
  }
  EXPECT_EQ(odometry.counts().slips, 0u);
  // Both roundings together are at most 0.01 m/s.
  EXPECT_NEAR(yawOfRotation(estimate->odometry.odom_from_vehicle.rotation()), 10.0 * kYawRate,
              10.0 * 0.01 / car.track_width_m);
}

TEST(WheelSpeedsTest, MissingMessagesCostLittleAndAGapWidensTheCovariance) {
  const VehicleMotion motion = drive(2.5);
  std::mt19937 random(3);
  const Outcome lossy = run(motion, [&](double time_s, WheelSpeeds* speeds) {
    speeds->stamp = time_s > 0.0 && random() % 3 == 0 ? Timestamp() : speeds->stamp;
  });
  EXPECT_LE(lossy.position_m, 0.01 * lossy.length_m);
  EXPECT_EQ(lossy.counts.gaps, 0u);
  const Outcome silent = run(motion, [&](double time_s, WheelSpeeds* speeds) {
    speeds->stamp = time_s > 10.0 && time_s < 12.0 ? Timestamp() : speeds->stamp;
  });
  EXPECT_EQ(silent.counts.gaps, 1u);
  EXPECT_LE(silent.yaw_deg, 0.25 * WheelOdometryOptions().max_yaw_acceleration_rad_per_s2 * 4.0 * kDegrees);

  WheelOdometry odometry((WheelOdometryOptions()));
  WheelSpeeds speeds;
  speeds.rear_left_m_per_s = speeds.rear_right_m_per_s = 3.0;
  const auto sigmaAfter = [&](double dt_s) {
    speeds.stamp = speeds.stamp + durationFromSeconds(dt_s);
    return std::sqrt(odometry.add(speeds)->pose_covariance(0, 0));
  };
  sigmaAfter(0.02);
  EXPECT_LE(sigmaAfter(0.02), 0.05);
  EXPECT_GE(sigmaAfter(4.0), 0.25 * 1.5 * 16.0);
}

TEST(WheelSpeedsTest, ALongGapIsNoMotion) {
  WheelOdometry odometry((WheelOdometryOptions()));
  WheelSpeeds speeds;
  speeds.rear_left_m_per_s = speeds.rear_right_m_per_s = 15.0;
  std::optional<OdometryEstimate> estimate;
  for (int i = 0; i < 200; ++i) {
    speeds.stamp = kStart + std::chrono::milliseconds(20 * i) + std::chrono::hours(i < 100 ? 0 : 24);
    estimate = odometry.add(speeds);
  }
  EXPECT_EQ(odometry.counts().resets, 1u);
  EXPECT_NEAR(estimate->odometry.odom_from_vehicle.translation().x(), 2 * 99 * 0.3, 0.3);
  EXPECT_GE(estimate->pose_covariance(0, 0), 1e4);
}

TEST(WheelSpeedsTest, WhateverTheCarTellsThePoseIsFinite) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  WheelOdometry odometry((WheelOdometryOptions()));
  WheelSpeeds speeds;
  speeds.stamp = kStart;
  const auto maybe = [&](double value) { return random() % 4 == 0 ? WheelSpeeds::kUnknown : value; };
  for (int i = 0; i < 20000; ++i) {
    const double step_s = random() % 50 == 0 ? 30.0 * number(random) : 0.02 * number(random) + 0.015;
    speeds.stamp = speeds.stamp + durationFromSeconds(step_s);
    speeds.rear_left_m_per_s = random() % 3 == 0 ? 0.0 : 60.0 * number(random);
    speeds.rear_right_m_per_s = random() % 3 == 0 ? 0.0 : 60.0 * number(random);
    speeds.front_left_m_per_s = maybe(60.0 * number(random));
    speeds.front_right_m_per_s = maybe(60.0 * number(random));
    speeds.steering_angle_rad = maybe(2.0 * number(random));
    if (const auto estimate = odometry.add(speeds)) {
      ASSERT_TRUE(estimate->odometry.odom_from_vehicle.matrix().allFinite());
      ASSERT_TRUE(estimate->pose_covariance.allFinite());
      ASSERT_TRUE(std::isfinite(estimate->odometry.forward_speed_m_per_s));
      ASSERT_TRUE(std::isfinite(estimate->odometry.yaw_rate_rad_per_s));
    }
  }
}

TEST(WheelSpeedsTest, ScalesOfTheWheelsApplyToSpeedsAndTicks) {
  WheelOdometryOptions options;
  options.left_scale = options.right_scale = 1.1;
  WheelOdometry from_speeds(options);
  WheelOdometry from_ticks(options);
  std::optional<OdometryEstimate> speeds_end, ticks_end;
  for (int i = 0; i <= 500; ++i) {
    WheelSpeeds speeds;
    WheelTicks ticks;
    speeds.stamp = ticks.stamp = kStart + std::chrono::milliseconds(20 * i);
    speeds.rear_left_m_per_s = speeds.rear_right_m_per_s = 2.0;
    ticks.left_ticks = ticks.right_ticks = 4 * i;
    speeds_end = from_speeds.add(speeds);
    ticks_end = from_ticks.add(ticks);
  }
  EXPECT_NEAR(speeds_end->odometry.odom_from_vehicle.translation().x(), 22.0, 0.02);
  EXPECT_NEAR(ticks_end->odometry.odom_from_vehicle.translation().x(), 22.0, 0.02);
}

TEST(WheelSpeedsTest, TicksAndSpeedsInOneDriveAreABugOfTheCaller) {
  WheelOdometry odometry((WheelOdometryOptions()));
  WheelTicks ticks;
  ticks.stamp = kStart;
  odometry.add(ticks);
  WheelSpeeds speeds;
  speeds.stamp = kStart + std::chrono::milliseconds(20);
  EXPECT_THROW(odometry.add(speeds), std::logic_error);
}

}  // namespace
}  // namespace vcharge
