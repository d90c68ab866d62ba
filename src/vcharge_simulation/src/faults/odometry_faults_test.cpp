#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "vcharge_simulation/drive/drive_simulator.h"

namespace vcharge {
namespace {

constexpr double kSpeed_m_per_s = 2.5;
constexpr double kTick_m = 0.01;
// The cruise speed varies by 5 %, and each counter is within a tick of the truth.
constexpr double kTickTolerance = 2.5;

// Simulates two seconds straight ahead.
SimulatedDrive simulate(const FaultOptions& faults) {
  const DrivePath straight(RigidTransform(), {{40.0, 0.0, 0.0}});
  VehicleMotionOptions motion;
  motion.duration_s = 2.0;
  WheelOdometerOptions odometer;
  odometer.scale_error = 0.0;
  odometer.left_right_error = 0.0;
  return simulateDrive(straight, motion, odometer, 1, 1, faults);
}

double timeOf(const SimulatedDrive& drive, Timestamp stamp) {
  return toSeconds(stamp - drive.ground_truth.front().stamp);
}

const VehicleOdometry& odometryAt(const SimulatedDrive& drive, double time_s) {
  for (const auto& [odometry, received] : drive.odometry) {
    if (std::abs(timeOf(drive, odometry.stamp) - time_s) < 1e-4) {
      return odometry;
    }
  }
  throw std::out_of_range("no odometry at this time");
}

const WheelTicks& ticksAt(const SimulatedDrive& drive, double time_s) {
  for (const auto& [ticks, received] : drive.wheel_ticks) {
    if (std::abs(timeOf(drive, ticks.stamp) - time_s) < 1e-4) {
      return ticks;
    }
  }
  throw std::out_of_range("no counters at this time");
}

void expectSameTruth(const SimulatedDrive& a, const SimulatedDrive& b) {
  ASSERT_EQ(a.ground_truth.size(), b.ground_truth.size());
  for (size_t i = 0; i < a.ground_truth.size(); ++i) {
    EXPECT_EQ(a.ground_truth[i].odom_from_vehicle.matrix(), b.ground_truth[i].odom_from_vehicle.matrix());
  }
}

TEST(OdometryFaultsTest, ScaleMultipliesCountersAndPathAlike) {
  FaultOptions faults;
  faults.odometry_scale.factor = 1.2;
  const SimulatedDrive right = simulate({});
  const SimulatedDrive wrong = simulate(faults);
  expectSameTruth(right, wrong);
  EXPECT_NEAR(static_cast<double>(ticksAt(wrong, 2.0).left_ticks),
              1.2 * static_cast<double>(ticksAt(right, 2.0).left_ticks), 2.0);
  EXPECT_NEAR(odometryAt(wrong, 2.0).odom_from_vehicle.translation().x(),
              1.2 * odometryAt(right, 2.0).odom_from_vehicle.translation().x(), kTick_m);
}

TEST(OdometryFaultsTest, SlipChangesOnlyThatWheelInThatInterval) {
  FaultOptions faults;
  faults.wheel_slip.wheel = WheelSlipFault::Wheel::kRight;
  faults.wheel_slip.ratio = 0.3;
  faults.wheel_slip.start_s = 0.8;
  faults.wheel_slip.end_s = 1.2;
  const SimulatedDrive right = simulate({});
  const SimulatedDrive wrong = simulate(faults);
  expectSameTruth(right, wrong);
  ASSERT_EQ(right.wheel_ticks.size(), wrong.wheel_ticks.size());
  const double slipped_ticks = 0.3 * 0.4 * kSpeed_m_per_s / kTick_m;
  for (size_t i = 0; i < right.wheel_ticks.size(); ++i) {
    const WheelTicks& right_ticks = right.wheel_ticks[i].message;
    const WheelTicks& wrong_ticks = wrong.wheel_ticks[i].message;
    EXPECT_EQ(right_ticks.left_ticks, wrong_ticks.left_ticks);
    const double time_s = timeOf(right, right_ticks.stamp);
    const auto difference = static_cast<double>(wrong_ticks.right_ticks - right_ticks.right_ticks);
    if (time_s < 0.8) {
      EXPECT_EQ(difference, 0.0);
    } else if (time_s >= 1.2) {
      EXPECT_NEAR(difference, slipped_ticks, kTickTolerance);
    }
  }
  // The heading would change by the difference of the wheel distances over the track width; the odometry
  // recognizes the slip by the steering.
  EXPECT_LT(std::abs(yawOfRotation(odometryAt(wrong, 2.0).odom_from_vehicle.rotation())),
            0.2 * slipped_ticks * kTick_m / VehicleMotionOptions().track_width_m);
}

TEST(OdometryFaultsTest, BlockedWheelStandsStill) {
  FaultOptions faults;
  faults.wheel_slip.ratio = -1.0;
  faults.wheel_slip.start_s = 1.0;
  const SimulatedDrive drive = simulate(faults);
  EXPECT_EQ(ticksAt(drive, 1.0).left_ticks, ticksAt(drive, 2.0).left_ticks);
  EXPECT_GT(ticksAt(drive, 2.0).right_ticks, ticksAt(drive, 1.0).right_ticks + 200);
}

TEST(OdometryFaultsTest, MissingCountersLeaveAGapAndThePathGoesOnAfterIt) {
  FaultOptions faults;
  faults.missing_ticks.start_s = 0.8;
  faults.missing_ticks.end_s = 1.2;
  const SimulatedDrive right = simulate({});
  const SimulatedDrive wrong = simulate(faults);
  expectSameTruth(right, wrong);
  std::map<int64_t, WheelTicks> ticks;
  for (const auto& [entry, received] : right.wheel_ticks) {
    ticks[entry.stamp.nanoseconds()] = entry;
  }
  for (const auto& [entry, received] : wrong.wheel_ticks) {
    const double time_s = timeOf(wrong, entry.stamp);
    EXPECT_TRUE(time_s < 0.8 || time_s >= 1.2) << time_s;
    EXPECT_EQ(entry.left_ticks, ticks.at(entry.stamp.nanoseconds()).left_ticks);
  }
  EXPECT_EQ(right.wheel_ticks.size() - wrong.wheel_ticks.size(), 20U);
  for (const auto& [entry, received] : wrong.odometry) {
    const double time_s = timeOf(wrong, entry.stamp);
    EXPECT_TRUE(time_s < 0.8 + 0.1 || time_s >= 1.2) << time_s << ": extrapolated by more than 0.1 s";
  }
  EXPECT_NEAR(odometryAt(wrong, 2.0).odom_from_vehicle.translation().x(),
              odometryAt(right, 2.0).odom_from_vehicle.translation().x(), kTick_m);
}

TEST(OdometryFaultsTest, ResetStartsCountersAndPathFromZero) {
  FaultOptions faults;
  faults.counter_reset.time_s = 1.0;
  const SimulatedDrive right = simulate({});
  const SimulatedDrive wrong = simulate(faults);
  expectSameTruth(right, wrong);
  EXPECT_EQ(ticksAt(wrong, 0.98).left_ticks, ticksAt(right, 0.98).left_ticks);
  EXPECT_EQ(ticksAt(wrong, 1.0).left_ticks, 0);
  EXPECT_EQ(ticksAt(wrong, 2.0).left_ticks, ticksAt(right, 2.0).left_ticks - ticksAt(right, 1.0).left_ticks);
  EXPECT_EQ(odometryAt(wrong, 0.98).odom_from_vehicle.matrix(),
            odometryAt(right, 0.98).odom_from_vehicle.matrix());
  EXPECT_EQ(odometryAt(wrong, 1.0).odom_from_vehicle.matrix(), RigidTransform().matrix());
  EXPECT_NEAR(odometryAt(wrong, 2.0).odom_from_vehicle.translation().x(), kSpeed_m_per_s, 0.15);
}

TEST(OdometryFaultsTest, SoftSuspensionDivesDeeperOnTheBrakes) {
  const DrivePath straight(RigidTransform(), {{6.0, 0.0, 0.0}});
  VehicleMotionOptions motion;
  motion.stop_at_end = true;
  motion.road_noise_rad = 0.0;
  const auto deepest_rad = [&](double pitch_factor) {
    FaultOptions faults;
    faults.soft_suspension.pitch_factor = pitch_factor;
    double deepest = 0.0;
    for (const VehicleOdometry& truth :
         simulateDrive(straight, motion, WheelOdometerOptions(), 1, 1, faults).ground_truth) {
      const Eigen::Vector3d forward = truth.odom_from_vehicle.rotation() * Eigen::Vector3d::UnitX();
      deepest = std::max(deepest, -std::asin(forward.z()));
    }
    return deepest;
  };
  const double usual_rad = deepest_rad(1.0);
  EXPECT_GT(usual_rad, 0.002);
  EXPECT_NEAR(deepest_rad(6.0), 6.0 * usual_rad, 0.01 * usual_rad);
}

TEST(OdometryFaultsTest, ALoadedBootTiltsAndLowersTheBody) {
  FaultOptions faults;
  faults.loaded_boot.pitch_rad = 0.01;
  faults.loaded_boot.start_s = 0.5;
  const SimulatedDrive empty = simulate({}), loaded = simulate(faults);
  ASSERT_EQ(empty.ground_truth.size(), loaded.ground_truth.size());
  int num_before = 0, num_after = 0;
  for (size_t i = 0; i < empty.ground_truth.size(); ++i) {
    const RigidTransform& usual = empty.ground_truth[i].odom_from_vehicle;
    const RigidTransform moved = usual.inverse() * loaded.ground_truth[i].odom_from_vehicle;
    const double time_s = toSeconds(empty.ground_truth[i].stamp - empty.ground_truth.front().stamp);
    const double pitch_rad = vectorFromRotation(moved.rotation()).y();
    if (time_s < 0.5) {
      ++num_before;
      EXPECT_EQ(moved.translation().norm() + std::abs(pitch_rad), 0.0);
    } else if (time_s > 1.5) {
      ++num_after;
      EXPECT_NEAR(pitch_rad, -0.01, 1e-4);  // nose up
      EXPECT_NEAR(moved.translation().z(), -0.01 * VehicleMotionOptions().wheelbase_m, 1e-3);
    }
  }
  EXPECT_GT(std::min(num_before, num_after), 5);
}

TEST(OdometryFaultsTest, MotionOfAnImageCoversItsExposureAndReadout) {
  FaultOptions faults;
  faults.motion_blur.cameras = {"left"};
  faults.motion_blur.exposure_time_s = 0.04;
  faults.rolling_shutter.cameras = {"left"};
  faults.rolling_shutter.readout_time_s = 0.0205;
  faults.image_stamp_shift.cameras = {"left"};
  faults.image_stamp_shift.shifts_s = {-0.01};
  faults.image_stamp_shift.moves_exposure = true;
  const SimulatedDrive drive = simulate(faults);
  expectSameTruth(simulate({}), drive);
  ASSERT_EQ(drive.image_motion.size(), drive.world_from_vehicle.size());
  constexpr double kReach_s = 0.04025;
  for (size_t i = 0; i < drive.image_motion.size(); ++i) {
    const MotionWindow& motion = drive.image_motion[i];
    EXPECT_EQ(motion.at(0.0).matrix(), drive.world_from_vehicle[i].world_from_vehicle.matrix());
    const Eigen::Vector3d driven_m = motion.at(kReach_s).translation() - motion.at(-kReach_s).translation();
    // The cruise speed varies by 5 %.
    EXPECT_NEAR(driven_m.norm(), 2.0 * kReach_s * kSpeed_m_per_s, 0.05 * 2.0 * kReach_s * kSpeed_m_per_s);
  }
}

}  // namespace
}  // namespace vcharge
