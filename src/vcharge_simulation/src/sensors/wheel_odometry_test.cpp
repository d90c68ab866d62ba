#include "vcharge_wheel_odometry/wheel_odometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include <Eigen/Eigenvalues>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/sensors/wheel_odometer.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr int kTickPeriod_ms = 20;
constexpr int kFramePeriod_ms = 80;
const Timestamp kStart = Timestamp::fromNanoseconds(1700000000000000000);

Timestamp atMilliseconds(int milliseconds) {
  return kStart + std::chrono::milliseconds(milliseconds);
}

VehicleMotion alongPath(const DrivePath& path, double cruise_speed_m_per_s, uint64_t seed) {
  VehicleMotionOptions options;
  options.cruise_speed_m_per_s = cruise_speed_m_per_s;
  options.standstill_s = 2.0;
  options.stop_at_end = true;
  options.duration_s = 120.0;
  return VehicleMotion(path, options, seed);
}

// Two rounds of curves to either side with straight lines between, with a start and a stop.
VehicleMotion drive(double cruise_speed_m_per_s) {
  return alongPath(
      DrivePath::throughWaypoints(
          {{0, 0}, {40, 0}, {40, 25}, {60, 25}, {60, 50}, {20, 50}, {20, 30}, {0, 30}}, true, 6.0, 3.0),
      cruise_speed_m_per_s, 3);
}

WheelOdometerOptions exactWheels() {
  WheelOdometerOptions options;
  options.scale_error = 0.0;
  options.left_right_error = 0.0;
  return options;
}

struct Errors {
  double max_distance_m = 0.0;
  double max_yaw_deg = 0.0;
  double rms_yaw_jitter_deg = 0.0;  // jitter of the turn from frame to frame
  double max_yaw_jitter_deg = 0.0;
  double max_position_m = 0.0;
  double length_m = 0.0;
  WheelOdometryCounts counts;
};

double normalized(double angle) {
  return std::remainder(angle, 2.0 * M_PI);
}

// Drives with the ticks at kTickPeriod_ms; compares at the triggers, which are not at the ticks.
Errors compare(const VehicleMotion& motion, const WheelOdometer& odometer,
               const WheelOdometryOptions& options, int start_ms = 0) {
  WheelOdometry odometry(options);
  OdometryStream stream(0.12, 0.1);
  Errors errors;
  const int end_ms = static_cast<int>(motion.duration() * 1000.0) - 100;
  const MotionSample& origin = motion.at(0);
  double last_yaw_error = 0.0;
  double sum_squares = 0.0;
  int num_frames = 0;
  double travelled_m = 0.0;
  std::optional<RigidTransform> last_pose;
  for (int ms = start_ms; ms < end_ms; ++ms) {
    if (ms % kTickPeriod_ms == 0) {
      WheelTicks ticks = odometer.ticks(ms);
      ticks.stamp = atMilliseconds(ms);
      stream.add(*odometry.add(ticks));
    }
    if (ms % kFramePeriod_ms == 50) {  // the trigger of 30 ms ago arrives
      const std::vector<OdometryEstimate> ready = stream.trigger(atMilliseconds(ms - 33));
      if (ready.empty()) {
        continue;
      }
      const RigidTransform& pose = ready.back().odometry.odom_from_vehicle;
      const MotionSample& truth = motion.at(ms - 33);
      const RigidTransform true_pose = origin.world_from_planar.inverse() * truth.world_from_planar;
      const double yaw_error =
          normalized(yawOfRotation(pose.rotation()) - yawOfRotation(true_pose.rotation()));
      if (last_pose) {
        travelled_m += (last_pose->inverse() * pose).translation().x() > 0
                           ? (pose.translation() - last_pose->translation()).norm()
                           : -(pose.translation() - last_pose->translation()).norm();
        const double jitter = normalized(yaw_error - last_yaw_error) * kDegrees;
        errors.max_yaw_jitter_deg = std::max(errors.max_yaw_jitter_deg, std::abs(jitter));
        sum_squares += jitter * jitter;
        ++num_frames;
      }
      const double true_m =
          0.5 * (truth.left_wheel_m + truth.right_wheel_m - origin.left_wheel_m - origin.right_wheel_m);
      errors.max_distance_m = std::max(errors.max_distance_m, std::abs(travelled_m - true_m));
      errors.max_yaw_deg = std::max(errors.max_yaw_deg, std::abs(yaw_error) * kDegrees);
      errors.max_position_m =
          std::max(errors.max_position_m, (pose.translation() - true_pose.translation()).norm());
      errors.length_m = true_m;
      last_pose = pose;
      last_yaw_error = yaw_error;
    }
  }
  errors.rms_yaw_jitter_deg = std::sqrt(sum_squares / num_frames);
  errors.counts = odometry.counts();
  return errors;
}

void print(const char* what, const Errors& e) {
  std::cout << what << ": " << e.length_m << " m; distance within " << 100 * e.max_distance_m
            << " cm, yaw within " << e.max_yaw_deg << " deg, position within " << 100 * e.max_position_m
            << " cm; yaw from frame to frame " << e.rms_yaw_jitter_deg << " deg rms, " << e.max_yaw_jitter_deg
            << " deg at most\n";
}

TEST(WheelOdometryTest, ASimulatedDriveIsRightWithinTheEncodersResolutionAndSmooth) {
  for (const double speed : {1.0, 2.5, 6.0}) {
    const VehicleMotion motion = drive(speed);
    const WheelOdometer odometer(motion, exactWheels(), 5);
    const Errors errors = compare(motion, odometer, WheelOdometryOptions());
    print(("at " + std::to_string(speed) + " m/s").c_str(), errors);
    const double tick_m = exactWheels().metres_per_tick;
    const double tick_deg = tick_m / motion.options().track_width_m * kDegrees;
    EXPECT_LE(errors.max_distance_m, tick_m);
    EXPECT_LE(errors.max_yaw_deg, tick_deg);
    // The steering's lag counts with the speed.
    EXPECT_LE(errors.rms_yaw_jitter_deg, speed > 3.0 ? 0.04 : 0.03);
    EXPECT_EQ(errors.counts.slips, 0u);
    EXPECT_GT(errors.length_m, 80.0);
  }
}

// The filter's constants were chosen on the drives above; these are of other shapes.
TEST(WheelOdometryTest, DrivesThatNothingWasChosenOnAreRightAndSmoothToo) {
  // Tighter curves; a parking manoeuvre with two turnarounds; a weave that never goes straight.
  const DrivePath tight = DrivePath::throughWaypoints({{0, 0}, {25, 0}, {25, 14}, {0, 14}}, true, 4.5, 2.0);
  const DrivePath parking(RigidTransform(), {{12.0, 0.0, 0.0},
                                             {2.0, 0.0, 0.18},
                                             {5.0, 0.18, 0.18},
                                             {2.0, 0.18, 0.0},
                                             {2.0, 0.0, -0.18, true},
                                             {4.0, -0.18, -0.18, true},
                                             {2.0, -0.18, 0.0, true},
                                             {15.0, 0.0, 0.0}});
  std::vector<DrivePath::Segment> weave;
  for (int i = 0; i < 12; ++i) {
    const double side = i % 2 == 0 ? 0.12 : -0.12;
    weave.push_back({3.5, -side, side});
    weave.push_back({2.5, side, side});
  }
  const std::vector<std::pair<std::string, DrivePath>> paths = {
      {"tight", tight}, {"parking", parking}, {"weave", DrivePath(RigidTransform(), weave)}};
  for (const auto& [name, path] : paths) {
    for (const uint64_t seed : {101, 102, 103}) {
      const double speed = seed == 101 ? 1.2 : seed == 102 ? 2.0 : 3.5;
      const VehicleMotion motion = alongPath(path, speed, seed);
      const WheelOdometer odometer(motion, exactWheels(), seed + 10);
      const Errors errors = compare(motion, odometer, WheelOdometryOptions());
      print((name + " at " + std::to_string(speed) + " m/s").c_str(), errors);
      const double tick_m = exactWheels().metres_per_tick;
      EXPECT_LE(errors.max_distance_m, tick_m) << name;
      EXPECT_LE(errors.max_yaw_deg, tick_m / motion.options().track_width_m * kDegrees) << name;
      EXPECT_LE(errors.rms_yaw_jitter_deg, 0.03) << name;
      EXPECT_EQ(errors.counts.slips, 0u) << name;
    }
  }
}

TEST(WheelOdometryTest, AnotherSteeringLagThanTheOptionsSayCostsLittle) {
  const VehicleMotion motion = drive(2.5);
  for (const double lag_s : {0.0, 0.1}) {
    WheelOdometerOptions sensors = exactWheels();
    sensors.steering_lag_s = lag_s;
    const WheelOdometer odometer(motion, sensors, 5);
    const Errors errors = compare(motion, odometer, WheelOdometryOptions());
    print(("steering that lags by " + std::to_string(lag_s) + " s").c_str(), errors);
    EXPECT_LE(errors.max_yaw_deg, 2.0 * sensors.metres_per_tick / motion.options().track_width_m * kDegrees);
    EXPECT_LE(errors.rms_yaw_jitter_deg, 0.06);
    EXPECT_EQ(errors.counts.slips, 0u);
  }
}

TEST(WheelOdometryTest, FindsTheSteeringsZero) {
  const VehicleMotion motion = drive(2.5);
  const WheelOdometer odometer(motion, exactWheels(), 5);
  WheelOdometry odometry((WheelOdometryOptions()));
  double yaw_error_deg = 0.0;
  for (int ms = 0; ms < 60000; ms += kTickPeriod_ms) {
    WheelTicks ticks = odometer.ticks(ms);
    ticks.stamp = atMilliseconds(ms);
    ticks.steering_angle_rad += 0.01;
    const auto estimate = odometry.add(ticks);
    const double true_yaw = yawOfRotation(
        (motion.at(0).world_from_planar.inverse() * motion.at(ms).world_from_planar).rotation());
    yaw_error_deg =
        std::abs(normalized(yawOfRotation(estimate->odometry.odom_from_vehicle.rotation()) - true_yaw)) *
        kDegrees;
  }
  EXPECT_LE(yaw_error_deg, 2.0 * 0.377);
  EXPECT_EQ(odometry.counts().slips, 0u);
}

TEST(WheelOdometryTest, WithoutSteeringItIsRightButLessSmooth) {
  const VehicleMotion motion = drive(2.5);
  const WheelOdometer odometer(motion, exactWheels(), 5);
  WheelOdometryOptions options;
  options.use_steering = false;
  const Errors errors = compare(motion, odometer, options);
  print("without steering", errors);
  EXPECT_LE(errors.max_distance_m, 0.02);
  EXPECT_LE(errors.rms_yaw_jitter_deg, 0.3);
}

TEST(WheelOdometryTest, ASlippingWheelTurnsNothing) {
  const VehicleMotion motion = drive(2.5);
  FaultOptions faults;
  readFields(YAML::Load("{wheel_slip: {start_s: 10, end_s: 12, wheel: left, ratio: 0.5}}"), "x", &faults);
  const WheelOdometer odometer(motion, exactWheels(), 5, faults);
  const Errors errors = compare(motion, odometer, WheelOdometryOptions());
  print("a slip of 50 % for 2 s", errors);
  WheelOdometryOptions blind;
  blind.slip_yaw_rad = 1e6;
  const Errors blind_errors = compare(motion, odometer, blind);
  print("the same, not looked for", blind_errors);
  EXPECT_GE(errors.counts.slips, 1u);
  EXPECT_FALSE(errors.counts.slipping);
  EXPECT_LE(errors.max_yaw_deg, 5.0);
  EXPECT_GE(blind_errors.max_yaw_deg, 5.0 * errors.max_yaw_deg);
}

TEST(WheelOdometryTest, StandsStillToTheLastBit) {
  WheelOdometry odometry((WheelOdometryOptions()));
  std::optional<RigidTransform> pose;
  for (int i = 0; i < 300; ++i) {
    WheelTicks ticks;
    ticks.stamp = atMilliseconds(20 * i);
    ticks.left_ticks = ticks.right_ticks = std::min(i, 100) * 3;
    ticks.steering_angle_rad = i < 150 ? 0.0 : 0.3;  // turned while it stands
    const auto estimate = odometry.add(ticks);
    if (i == 150) {
      pose = estimate->odometry.odom_from_vehicle;
    }
    if (i > 150) {
      ASSERT_EQ(estimate->odometry.odom_from_vehicle.matrix(), pose->matrix());
      ASSERT_EQ(estimate->odometry.forward_speed_m_per_s, 0.0);
    }
  }
  EXPECT_TRUE(odometry.counts().standing);
  EXPECT_NEAR(pose->translation().x(), 3.0, 0.02);
}

TEST(WheelOdometryTest, CountersThatBeginAnewDoNotMoveTheCar) {
  WheelOdometry odometry((WheelOdometryOptions()));
  double last_x = 0.0;
  for (int i = 0; i < 200; ++i) {
    WheelTicks ticks;
    ticks.stamp = atMilliseconds(20 * i);
    ticks.left_ticks = ticks.right_ticks = 1000000 + 4 * i - (i >= 100 ? 1000300 : 0);
    const double x = odometry.add(ticks)->odometry.odom_from_vehicle.translation().x();
    ASSERT_LE(std::abs(x - last_x), 0.1);
    last_x = x;
  }
  EXPECT_EQ(odometry.counts().resets, 1u);
  EXPECT_NEAR(last_x, 199 * 0.04, 0.05);
}

TEST(WheelOdometryTest, TheCovarianceGrowsWithTheWayAndIsPositive) {
  const VehicleMotion motion = drive(2.5);
  const WheelOdometer odometer(motion, WheelOdometerOptions(), 5);  // with its errors of scale
  WheelOdometry odometry((WheelOdometryOptions()));
  double last_trace = 0.0;
  for (int ms = 0; ms < 40000; ms += kTickPeriod_ms) {
    WheelTicks ticks = odometer.ticks(ms);
    ticks.stamp = atMilliseconds(ms);
    const auto estimate = odometry.add(ticks);
    const Eigen::Matrix3d& covariance = estimate->pose_covariance;
    ASSERT_TRUE(covariance.isApprox(covariance.transpose()));
    ASSERT_GE(covariance.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-12);
    if (ms % 10000 == 0 && ms > 0) {
      EXPECT_GT(covariance.trace(), last_trace);
      last_trace = covariance.trace();
    }
  }
}

TEST(OdometryStreamTest, HasAnEstimateAtEveryTriggerInOrderOfStamps) {
  OdometryStream stream(0.12, 0.1);
  std::vector<Timestamp> stamps;
  std::vector<Timestamp> triggers;
  const auto keep = [&](const std::vector<OdometryEstimate>& ready) {
    for (const OdometryEstimate& estimate : ready) {
      // A car at 2 m/s: the position shows the time.
      ASSERT_NEAR(estimate.odometry.odom_from_vehicle.translation().x(),
                  2.0 * toSeconds(estimate.odometry.stamp - kStart), 1e-9);
      stamps.push_back(estimate.odometry.stamp);
    }
  };
  for (int ms = 0; ms < 4000; ++ms) {
    if (ms % 20 == 0) {
      OdometryEstimate estimate;
      estimate.odometry.stamp = atMilliseconds(ms);
      estimate.odometry.odom_from_vehicle = RigidTransform::planar(0.002 * ms, 0.0, 0.0);
      estimate.odometry.forward_speed_m_per_s = 2.0;
      keep(stream.add(estimate));
    }
    if (ms % 80 == 35 && ms < 3000) {
      triggers.push_back(atMilliseconds(ms % 160 == 35 ? ms - 30 : ms));  // every second one precedes a tick
      keep(stream.trigger(triggers.back()));
    }
  }
  for (size_t i = 1; i < stamps.size(); ++i) {
    ASSERT_LE(stamps[i - 1], stamps[i]) << "the same stamp again is a correction";
  }
  for (const Timestamp trigger : triggers) {
    EXPECT_TRUE(std::binary_search(stamps.begin(), stamps.end(), trigger));
  }
  EXPECT_GE(stamps.back(), atMilliseconds(3800)) << "they go on without triggers";
}

TEST(OdometryStreamTest, CorrectsAnExtrapolatedEstimateOnceTheTicksReachIt) {
  OdometryStream stream(0.12, 0.1);
  const auto at = [](int milliseconds, double x_m) {
    OdometryEstimate estimate;
    estimate.odometry.stamp = atMilliseconds(milliseconds);
    estimate.odometry.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
    estimate.odometry.forward_speed_m_per_s = 1.0;
    return estimate;
  };
  stream.add(at(0, 0.0));
  const auto extrapolated = stream.trigger(atMilliseconds(30));
  ASSERT_FALSE(extrapolated.empty());
  EXPECT_NEAR(extrapolated.back().odometry.odom_from_vehicle.translation().x(), 0.03, 1e-12);
  EXPECT_TRUE(stream.add(at(20, 0.01)).empty()) << "not yet reached";
  const auto corrected = stream.add(at(40, 0.02));  // slower than before
  ASSERT_EQ(corrected.size(), 1u);
  EXPECT_EQ(corrected[0].odometry.stamp, atMilliseconds(30));
  EXPECT_NEAR(corrected[0].odometry.odom_from_vehicle.translation().x(), 0.015, 1e-12);
}

TEST(OdometryStreamTest, DoesNotExtrapolateFarAhead) {
  OdometryStream stream(0.12, 0.1);
  EXPECT_TRUE(stream.trigger(kStart).empty());
  OdometryEstimate estimate;
  estimate.odometry.stamp = kStart;
  stream.add(estimate);
  const auto ready = stream.trigger(atMilliseconds(101));
  ASSERT_EQ(ready.size(), 1u);
  EXPECT_EQ(ready[0].odometry.stamp, kStart);
  EXPECT_EQ(stream.trigger(atMilliseconds(100)).size(), 1u);
}

TEST(WheelOdometryOptionsTest, RejectsBadOptionsByName) {
  WheelOdometryOptions options;
  options.track_width_m = 0.0;
  EXPECT_THAT([&] { WheelOdometry odometry(options); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::StartsWith("track_width_m: ")));
}

}  // namespace
}  // namespace vcharge
