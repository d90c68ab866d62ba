#include "vcharge_simulation/drive/drive_simulator.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

TEST(DriveSimulatorTest, ImagesComeEvery80Milliseconds) {
  const DrivePlan plan = planDrive("lot", "short");
  const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1);
  ASSERT_GT(drive.world_from_vehicle.size(), 50U);
  for (size_t i = 1; i < drive.world_from_vehicle.size(); ++i) {
    EXPECT_EQ((drive.world_from_vehicle[i].stamp - drive.world_from_vehicle[i - 1].stamp).count(),
              80'000'000);
  }
}

// Compares the turns from image to image with the truth: as the odometry first says, and after its
// correction.
TEST(DriveSimulatorTest, OdometryTurnsWithTruthAtTheImages) {
  for (const char* name : {"short", "figure_eight"}) {
    const DrivePlan plan = planDrive("lot", name);
    WheelOdometerOptions options;
    options.left_right_error = 0.0;
    const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, options, 3, 3);
    std::map<Timestamp, std::vector<RigidTransform>> said;
    for (const auto& [odometry, received] : drive.odometry) {
      said[odometry.stamp].push_back(odometry.odom_from_vehicle);
    }
    const StampedTransform* last = nullptr;
    double worst_first_rad = 0.0, worst_corrected_rad = 0.0;
    for (const StampedTransform& truth : drive.world_from_vehicle) {
      if (said.count(truth.stamp) == 0) {
        continue;
      }
      if (last != nullptr) {
        const std::vector<RigidTransform>& before = said[last->stamp];
        const std::vector<RigidTransform>& now = said[truth.stamp];
        EXPECT_LE(now.size(), 2U) << "an estimate and its correction";
        const double turn_rad =
            yawOfRotation((last->world_from_vehicle.inverse() * truth.world_from_vehicle).rotation());
        const auto error_rad = [&](const RigidTransform& odom_from_vehicle) {
          return std::abs(yawOfRotation((before.back().inverse() * odom_from_vehicle).rotation()) -
                          turn_rad * (1.0 + options.scale_error));
        };
        worst_first_rad = std::max(worst_first_rad, error_rad(now.front()));
        worst_corrected_rad = std::max(worst_corrected_rad, error_rad(now.back()));
      }
      last = &truth;
    }
    // A counter is exact within one tick of 1 cm, 0.38 degrees over the track width.
    EXPECT_LT(worst_first_rad, 0.38 * kDegree) << name;
    EXPECT_LT(worst_corrected_rad, 0.38 * kDegree) << name;
    RecordProperty(std::string("worst_mdeg_") + name, static_cast<int>(worst_first_rad / kDegree * 1000));
    RecordProperty(std::string("worst_corrected_mdeg_") + name,
                   static_cast<int>(worst_corrected_rad / kDegree * 1000));
  }
}

TEST(DriveSimulatorTest, OdometryAtAnImageUsesOnlyTicksReceivedByThen) {
  const DrivePlan plan = planDrive("lot", "figure_eight");
  WheelOdometerOptions options;
  VehicleMotionOptions motion = plan.motion;
  motion.duration_s = 8.0;
  const SimulatedDrive whole = simulateDrive(plan.path, motion, options, 3, 3);
  motion.duration_s = 6.0;
  const SimulatedDrive cut = simulateDrive(plan.path, motion, options, 3, 3);
  const Timestamp end = cut.ground_truth.back().stamp;
  size_t compared = 0;
  for (size_t i = 0; i < cut.odometry.size() && cut.odometry[i].received <= end; ++i, ++compared) {
    EXPECT_EQ(cut.odometry[i].message.stamp, whole.odometry[i].message.stamp);
    EXPECT_EQ(cut.odometry[i].message.odom_from_vehicle.matrix(),
              whole.odometry[i].message.odom_from_vehicle.matrix());
  }
  EXPECT_GT(compared, 300U);
  for (const auto& [odometry, received] : whole.odometry) {
    EXPECT_GE(received, odometry.stamp) << "published before it happened";
  }
}

TEST(DriveSimulatorTest, OdometryScalesWithTheWheelRadiusError) {
  const DrivePath straight(RigidTransform(), {{40.0, 0.0, 0.0}});
  VehicleMotionOptions motion;
  WheelOdometerOptions options;
  options.scale_error = 0.02;
  options.left_right_error = 0.0;
  const SimulatedDrive drive = simulateDrive(straight, motion, options, 5, 5);
  const VehicleOdometry& last = drive.odometry.back().message;
  const auto truth = std::find_if(drive.ground_truth.begin(), drive.ground_truth.end(),
                                  [&](const VehicleOdometry& each) { return each.stamp == last.stamp; });
  ASSERT_NE(truth, drive.ground_truth.end());
  const double driven_m =
      (truth->odom_from_vehicle.translation() - drive.ground_truth.front().odom_from_vehicle.translation())
          .head<2>()
          .norm();
  const double counted_m = last.odom_from_vehicle.translation().norm();
  // The drive starts at full speed, which the odometry learns in its first tenths of a second.
  EXPECT_NEAR(counted_m, 1.02 * driven_m, 3.0 * options.metres_per_tick);
  const auto ticks = static_cast<double>(drive.wheel_ticks.back().message.left_ticks);
  EXPECT_NEAR(ticks * 0.01, 1.02 * driven_m,
              0.01 + 2.7 * 0.02);  // the last ticks are at most 20 ms away from the last odometry
}

TEST(DriveSimulatorTest, StandsStillBeforeItStarts) {
  DrivePlan plan = planDrive("lot", "loop");
  plan.motion.duration_s = 0.5;
  const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1);
  EXPECT_EQ(drive.world_from_vehicle.front().world_from_vehicle.translation(),
            drive.world_from_vehicle.back().world_from_vehicle.translation());
  EXPECT_EQ(drive.wheel_ticks.back().message.left_ticks, 0);
}

TEST(DriveSimulatorTest, PlanarMotionObeysTheBicycleModelAndTheBodyTiltsALittle) {
  const DrivePlan plan = planDrive("lot", "figure_eight");
  const VehicleMotion motion(plan.path, plan.motion, 1);
  double largest_tilt_rad = 0.0;
  for (int ms = 0; ms < static_cast<int>(motion.duration() * 1000.0) - 1; ++ms) {
    const MotionSample& now = motion.at(ms);
    const MotionSample& next = motion.at(ms + 1);
    const RigidTransform step = now.world_from_planar.inverse() * next.world_from_planar;
    // The rear axle does not slip sideways, so the chord points along the mean heading.
    EXPECT_NEAR(std::atan2(step.translation().y(), step.translation().x()),
                0.5 * yawOfRotation(step.rotation()), 1e-8);
    largest_tilt_rad = std::max(largest_tilt_rad, angleOfRotation(now.planar_from_body.rotation()));
  }
  EXPECT_GT(largest_tilt_rad, 0.1 * kDegree);
  EXPECT_LT(largest_tilt_rad, 1.0 * kDegree);
}

TEST(DriveSimulatorTest, LoopEndsNearItsStart) {
  const DrivePlan plan = planDrive("lot", "loop");
  const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1);
  EXPECT_LT((drive.world_from_vehicle.back().world_from_vehicle.translation() -
             drive.world_from_vehicle.front().world_from_vehicle.translation())
                .norm(),
            1.0);
}

TEST(DriveSimulatorTest, BackwardsDriveReturnsToItsStart) {
  const DrivePath path(RigidTransform::planar(1.0, 2.0, 0.5),
                       {{5.0, 0.1, 0.1}, {5.0, 0.0, 0.0}, {5.0, 0.0, 0.0, true}, {5.0, 0.1, 0.1, true}});
  VehicleMotionOptions options;
  options.standstill_s = 0.5;
  options.stop_at_end = true;
  options.cruise_speed_m_per_s = 1.5;
  const VehicleMotion motion(path, options, 1);
  const MotionSample& end = motion.at(static_cast<int>(motion.duration() * 1000.0));
  // The car stops slightly before each of the two ends.
  EXPECT_LT((end.world_from_planar.translation() - path.worldFromStart().translation()).norm(), 0.7);
  EXPECT_NEAR(yawOfRotation(end.world_from_planar.rotation()), 0.5, 0.1);
  EXPECT_NEAR(end.left_wheel_m, 0.0, 0.7);
  double slowest = 0.0;
  double farthest_m = 0.0;
  for (const MotionSample& sample : motion.samples()) {
    slowest = std::min(slowest, sample.speed_m_per_s);
    farthest_m = std::max(farthest_m, sample.left_wheel_m);
  }
  EXPECT_LT(slowest, -1.0);
  EXPECT_GT(farthest_m, 8.5);
}

TEST(DriveSimulatorTest, StandsAtEachStopAsLongAsItShould) {
  DrivePath path(RigidTransform(), {{20.0, 0.0, 0.0}});
  path.addStop({6.0, 2.0});
  path.addStop({12.0, 1.0});
  VehicleMotionOptions options;
  options.standstill_s = 0.5;
  const VehicleMotion motion(path, options, 1);
  int standing_ms = 0;
  for (int ms = 1000; ms < static_cast<int>(motion.duration() * 1000.0); ++ms) {
    standing_ms += motion.at(ms).speed_m_per_s == 0.0 ? 1 : 0;
  }
  EXPECT_NEAR(standing_ms, 3000, 5);
}

TEST(DriveSimulatorTest, CarStandsOnSlopingGroundAndItsWheelsCountTheWayOnIt) {
  constexpr double kRise = 0.1;
  const DrivePath path(RigidTransform::planar(3.0, -2.0, 0.0), {{30.0, 0.0, 0.0}});
  VehicleMotionOptions options;
  options.pitch_rad_per_m_per_s2 = options.road_noise_rad = options.road_heave_m = 0.0;
  const VehicleMotion motion(path, options, 1, [](double x, double) { return kRise * x; });
  const MotionSample& start = motion.at(0);
  const MotionSample& end = motion.at(5000);
  const RigidTransform world_from_vehicle = end.worldFromVehicle();
  EXPECT_NEAR(world_from_vehicle.translation().z(), kRise * world_from_vehicle.translation().x(), 1e-9);
  const Eigen::Vector3d forwards = world_from_vehicle.rotation() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(forwards.z() / forwards.x(), kRise, 1e-9);
  const double driven_m = (world_from_vehicle.translation() - start.worldFromVehicle().translation()).norm();
  EXPECT_GT(driven_m, 8.0);
  EXPECT_NEAR(end.left_wheel_m - start.left_wheel_m, driven_m, 1e-6);
  // The speed is measured along the slope.
  EXPECT_NEAR((motion.at(5001).worldFromVehicle().translation() - world_from_vehicle.translation()).norm(),
              1e-3 * end.speed_m_per_s, 1e-6);
}

TEST(DriveSimulatorTest, CarRollsOnGroundThatFallsToItsRight) {
  const DrivePath path(RigidTransform(), {{30.0, 0.0, 0.0}});
  VehicleMotionOptions options;
  options.road_noise_rad = 0.0;
  const VehicleMotion motion(path, options, 1, [](double, double y) { return 0.05 * y; });
  const Eigen::Vector3d left = motion.at(2000).worldFromVehicle().rotation() * Eigen::Vector3d::UnitY();
  EXPECT_NEAR(left.z() / left.y(), 0.05, 1e-9);
}

TEST(DriveSimulatorTest, SpeedsAreThoseOfTheWheelsInStepsAndGiveOdometryAsGoodAsTicks) {
  const DrivePlan plan = planDrive("lot", "loop");
  WheelOdometerOptions options;
  options.scale_error = options.left_right_error = 0.0;
  const auto drive = [&](WheelSensor sensor) {
    options.sensor = sensor;
    return simulateDrive(plan.path, plan.motion, options, 1, 1);
  };
  const auto endErrorOf = [](const SimulatedDrive& simulated) {
    const Timestamp end = simulated.ground_truth.back().stamp;
    for (auto entry = simulated.odometry.rbegin(); entry != simulated.odometry.rend(); ++entry) {
      if (entry->message.stamp == end) {
        const RigidTransform first_from_last = simulated.ground_truth.front().odom_from_vehicle.inverse() *
                                               simulated.ground_truth.back().odom_from_vehicle;
        return (entry->message.odom_from_vehicle.translation() - first_from_last.translation())
            .head<2>()
            .norm();
      }
    }
    return 1e9;
  };
  const SimulatedDrive ticks = drive(WheelSensor::kTicks);
  EXPECT_TRUE(ticks.wheel_speeds.empty());
  for (const WheelSensor sensor : {WheelSensor::kRearSpeeds, WheelSensor::kSpeeds}) {
    const SimulatedDrive speeds = drive(sensor);
    EXPECT_TRUE(speeds.wheel_ticks.empty());
    ASSERT_EQ(speeds.wheel_speeds.size(), ticks.wheel_ticks.size());
    std::map<Timestamp, VehicleOdometry> truth;
    for (const VehicleOdometry& each : speeds.ground_truth) {
      truth[each.stamp] = each;
    }
    for (const auto& [wheels, received] : speeds.wheel_speeds) {
      const double speed = truth.at(wheels.stamp).forward_speed_m_per_s;
      const double sideways = 0.5 * plan.motion.track_width_m * truth.at(wheels.stamp).yaw_rate_rad_per_s;
      EXPECT_NEAR(wheels.rear_left_m_per_s, speed - sideways, 0.0075);  // half a step and the road's bumps
      EXPECT_NEAR(wheels.rear_right_m_per_s, speed + sideways, 0.0075);
      EXPECT_NEAR(std::remainder(wheels.rear_left_m_per_s, 0.01), 0.0, 1e-9);
      if (sensor == WheelSensor::kSpeeds) {
        const double axle = plan.motion.wheelbase_m * truth.at(wheels.stamp).yaw_rate_rad_per_s;
        EXPECT_NEAR(wheels.front_left_m_per_s, std::hypot(speed - sideways, axle), 0.0075);
        EXPECT_NEAR(wheels.front_right_m_per_s, std::hypot(speed + sideways, axle), 0.0075);
      } else {
        EXPECT_TRUE(std::isnan(wheels.front_left_m_per_s));
      }
    }
    EXPECT_LT(endErrorOf(speeds), endErrorOf(ticks) + 0.01 * plan.path.length());
  }
}

}  // namespace
}  // namespace vcharge
