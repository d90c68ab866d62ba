#include "vcharge_wheel_odometry/wheel_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace vcharge {
namespace {

constexpr double kPeriod_s = 0.01;
constexpr double kTrack_m = 1.6;

struct Drive {
  std::vector<WheelMeasurement> wheels;
  Trajectory reference;
  std::vector<StampedPosition> positions;
};

struct Car {
  double left_scale = 1.0;  // true over told distance
  double right_scale = 1.0;
};

// A drive at 10 m/s with a curvature that depends on the time. The car's speeds are in steps of 0.01 m/s.
Drive drive(const Car& car, double duration_s, const std::function<double(double time_s)>& curvature_per_m) {
  constexpr double kSpeed_m_per_s = 10.0;
  Drive drive;
  RigidTransform world_from_vehicle;
  const auto steps = static_cast<int>(duration_s / kPeriod_s);
  for (int i = 0; i <= steps; ++i) {
    const double time_s = kPeriod_s * i;
    const double yaw_rate = kSpeed_m_per_s * curvature_per_m(time_s);
    const auto told = [&](double side, double scale) {
      return 0.01 * std::round(100.0 * (kSpeed_m_per_s + side * 0.5 * kTrack_m * yaw_rate) / scale);
    };
    WheelSpeeds speeds;
    speeds.stamp = Timestamp() + durationFromSeconds(time_s);
    speeds.rear_left_m_per_s = told(-1.0, car.left_scale);
    speeds.rear_right_m_per_s = told(1.0, car.right_scale);
    drive.wheels.emplace_back(speeds);
    if (i % 5 == 0) {
      drive.reference.push_back({speeds.stamp, world_from_vehicle});
      const Eigen::Vector3d& position = world_from_vehicle.translation();
      drive.positions.push_back({speeds.stamp, position.x(), position.y()});
    }
    const double next_yaw_rate = kSpeed_m_per_s * curvature_per_m(time_s + kPeriod_s);
    world_from_vehicle = world_from_vehicle *
                         arcMotion(kSpeed_m_per_s * kPeriod_s, 0.5 * (yaw_rate + next_yaw_rate) * kPeriod_s);
  }
  return drive;
}

double slalom(double time_s) {
  return 0.05 * std::sin(0.3 * time_s) + 0.02;
}

WheelOdometryOptions nominalCar() {
  WheelOdometryOptions options;
  options.track_width_m = 1.52;
  return options;
}

TEST(WheelCalibrationTest, FindsScalesAndTrackWidthOnADriveWithTurns) {
  const Car car{1.012, 1.009};
  const Drive turns = drive(car, 60.0, slalom);
  const WheelCalibration found = calibrateWheels(turns.wheels, turns.reference, nominalCar());
  ASSERT_TRUE(found.is_calibrated) << found.reason;
  // Without noise, only the prior's weak pull remains.
  EXPECT_NEAR(found.scale.value, 0.5 * (car.left_scale + car.right_scale), 0.5 * found.scale.sigma);
  EXPECT_NEAR(found.right_over_left.value, car.right_scale / car.left_scale,
              0.5 * found.right_over_left.sigma);
  EXPECT_NEAR(found.options.track_width_m, kTrack_m, 0.5 * found.track_width_m.sigma);
  EXPECT_LE(found.scale.sigma, 5e-3);
  EXPECT_LE(found.right_over_left.sigma, 5e-4);
  EXPECT_LE(found.track_width_m.sigma, 0.01);
  EXPECT_TRUE(found.scale.is_observable);
  EXPECT_TRUE(found.right_over_left.is_observable);
  EXPECT_TRUE(found.track_width_m.is_observable);
  EXPECT_NEAR(found.distance_m, 600.0, 1.0);
}

TEST(WheelCalibrationTest, OnAStraightRoadTheTrackWidthIsNotObservableAndStaysNominal) {
  const Car car{1.012, 1.009};
  const Drive straight = drive(car, 60.0, [](double) { return 0.0; });
  const WheelCalibration found = calibrateWheels(straight.wheels, straight.reference, nominalCar());
  ASSERT_TRUE(found.is_calibrated);
  EXPECT_NEAR(found.scale.value, 0.5 * (car.left_scale + car.right_scale), 3e-4);
  EXPECT_NEAR(found.right_over_left.value, car.right_scale / car.left_scale, 3e-4);
  EXPECT_FALSE(found.track_width_m.is_observable);
  EXPECT_NEAR(found.options.track_width_m, nominalCar().track_width_m, 0.002);
  EXPECT_NEAR(found.track_width_m.sigma, 0.03 * nominalCar().track_width_m, 0.005);
}

TEST(WheelCalibrationTest, WithoutHeadingsAndWithJumpsOfTheReferenceItIsRightWithinItsSigma) {
  const Car car{0.99, 0.992};
  Drive turns = drive(car, 120.0, slalom);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.03);
  for (size_t i = 0; i < turns.positions.size(); ++i) {
    const double jump_m = i > 1000 && i < 1030 ? 3.0 : 0.0;
    turns.positions[i].x_m += noise(random) + jump_m;
    turns.positions[i].y_m += noise(random);
  }
  const WheelCalibration found =
      calibrateWheels(turns.wheels, posesFromPositions(turns.positions), nominalCar());
  ASSERT_TRUE(found.is_calibrated);
  EXPECT_NEAR(found.scale.value, 0.991, 3.0 * found.scale.sigma);
  EXPECT_NEAR(found.right_over_left.value, 0.992 / 0.99, 3.0 * found.right_over_left.sigma);
  EXPECT_NEAR(found.track_width_m.value, kTrack_m, 3.0 * found.track_width_m.sigma);
}

TEST(WheelCalibrationTest, ADriveThatIsTooShortOrAnotherOneIsAVerdict) {
  const Drive brief = drive({}, 4.0, slalom);
  WheelCalibration found = calibrateWheels(brief.wheels, brief.reference, nominalCar());
  EXPECT_FALSE(found.is_calibrated);
  EXPECT_THAT(found.reason, ::testing::HasSubstr("at least 50 m"));
  EXPECT_EQ(found.options.left_scale, 1.0);
  found = calibrateWheels({}, brief.reference, nominalCar());
  EXPECT_FALSE(found.is_calibrated);
  found = calibrateWheels(brief.wheels, {}, nominalCar());
  EXPECT_FALSE(found.is_calibrated);
}

TEST(WheelCalibrationTest, HeadingsOfPositionsAreThoseOfTheRearAxle) {
  const Drive turns = drive({}, 30.0, [](double) { return 0.08; });  // a circle of 12.5 m radius
  const Trajectory poses = posesFromPositions(turns.positions);
  ASSERT_GT(poses.size(), 500u);
  for (const StampedTransform& pose : poses) {
    const auto index =
        static_cast<size_t>(std::lround(toSeconds(pose.stamp - Timestamp()) / (5 * kPeriod_s)));
    const double error = yawOfRotation(turns.reference.at(index).world_from_vehicle.rotation().inverse() *
                                       pose.world_from_vehicle.rotation());
    ASSERT_NEAR(error, 0.0, 1e-3);
  }
  EXPECT_TRUE(posesFromPositions({}).empty());
  EXPECT_TRUE(posesFromPositions({{Timestamp(), 1.0, 1.0}}).empty());
}

}  // namespace
}  // namespace vcharge
