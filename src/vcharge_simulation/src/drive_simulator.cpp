#include "vcharge_simulation/drive_simulator.h"

#include <cmath>

namespace vcharge {

namespace {

constexpr int kImagePeriod_ms = 80;
constexpr int kImageOffset_ms = 7;
constexpr int kOdometryPeriod_ms = 20;
// An arbitrary date: stamps have as many digits as those of real drives.
constexpr int64_t kStart_ns = 1'400'000'000'000'000'000;

Timestamp stampAt(int milliseconds) {
  return Timestamp::fromNanoseconds(kStart_ns + static_cast<int64_t>(milliseconds) * 1'000'000);
}

}  // namespace

SimulatedDrive simulateDrive(const DrivePath& path, const VehicleMotionOptions& motion_options,
                             const WheelOdometerOptions& odometer_options, uint64_t road_seed,
                             uint64_t wheel_seed, const GroundHeight& ground_height) {
  const VehicleMotion motion(path, motion_options, road_seed, ground_height);
  const WheelOdometer odometer(motion, odometer_options, wheel_seed + 1);
  const int duration_ms = static_cast<int>(std::floor(motion.duration() * 1000.0 + 0.5));
  SimulatedDrive drive;
  std::vector<int> odometry_ms;
  for (int time_ms = 0; time_ms <= duration_ms; ++time_ms) {
    const bool is_image = time_ms % kImagePeriod_ms == kImageOffset_ms;
    const bool is_odometry = time_ms % kOdometryPeriod_ms == 0;
    if (is_image) {
      drive.world_from_vehicle.push_back({stampAt(time_ms), motion.at(time_ms).worldFromVehicle()});
    }
    if (is_image || is_odometry) {
      odometry_ms.push_back(time_ms);
      const MotionSample& sample = motion.at(time_ms);
      VehicleOdometry truth;
      truth.stamp = stampAt(time_ms);
      truth.odom_from_vehicle = sample.worldFromVehicle();
      truth.forward_speed_m_per_s = sample.speed_m_per_s;
      truth.yaw_rate_rad_per_s = sample.speed_m_per_s * sample.curvature_per_m;
      drive.ground_truth.push_back(truth);
    }
    if (is_odometry) {
      WheelTicks ticks = odometer.ticks(time_ms);
      ticks.stamp = stampAt(time_ms);
      drive.wheel_ticks.push_back(ticks);
    }
  }
  drive.odometry = odometer.deadReckoning(odometry_ms);
  for (size_t i = 0; i < drive.odometry.size(); ++i) {
    drive.odometry[i].stamp = stampAt(odometry_ms[i]);
  }
  return drive;
}

}  // namespace vcharge
