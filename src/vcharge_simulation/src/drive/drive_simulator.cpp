#include "vcharge_simulation/drive/drive_simulator.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr int kImagePeriod_ms = 80;
constexpr int kImageOffset_ms = 7;
constexpr int kOdometryPeriod_ms = 20;
constexpr int kMargin_ms = 200;
// An arbitrary date with as many digits as the stamps of real drives.
constexpr int64_t kStart_ns = 1'400'000'000'000'000'000;

Timestamp stampAt(int milliseconds) {
  return Timestamp::fromNanoseconds(kStart_ns + static_cast<int64_t>(milliseconds) * 1'000'000);
}

// Time before and after the common trigger in which images are exposed and read out.
int reachOfImage_ms(const FaultOptions& faults) {
  const double blur_s = faults.motion_blur.isActive() ? faults.motion_blur.exposure_time_s : 0.0;
  const double readout_s = faults.rolling_shutter.isActive() ? faults.rolling_shutter.readout_time_s : 0.0;
  double shift_s = 0.0;
  for (const double shift_of_camera_s : faults.image_stamp_shift.shifts_s) {
    const bool counts = faults.image_stamp_shift.isActive() && faults.image_stamp_shift.moves_exposure;
    shift_s = counts ? std::max(shift_s, std::abs(shift_of_camera_s)) : shift_s;
  }
  return static_cast<int>(std::ceil(500.0 * (blur_s + readout_s) + 1000.0 * shift_s));
}

MotionWindow windowOf(const VehicleMotion& motion, int middle_ms, int reach_ms) {
  std::vector<RigidTransform> poses;
  for (int time_ms = middle_ms - reach_ms; time_ms <= middle_ms + reach_ms; ++time_ms) {
    poses.push_back(motion.at(time_ms).worldFromVehicle());
  }
  return MotionWindow(std::move(poses));
}

}  // namespace

SimulatedDrive simulateDrive(const DrivePath& path, const VehicleMotionOptions& motion_options,
                             const WheelOdometerOptions& odometer_options, uint64_t road_seed,
                             uint64_t wheel_seed, const FaultOptions& faults,
                             const GroundHeight& ground_height) {
  VehicleMotionOptions faulty_motion = motion_options;
  faulty_motion.pitch_rad_per_m_per_s2 *= faults.soft_suspension.pitch_factor;
  if (faults.loaded_boot.isActive()) {
    faulty_motion.load_pitch_rad = [load = faults.loaded_boot](Duration since_start) {
      return load.actsAt(since_start) ? load.pitch_rad : 0.0;
    };
  }
  const VehicleMotion motion(path, faulty_motion, road_seed, ground_height);
  const WheelOdometer odometer(motion, odometer_options, wheel_seed + 1, faults);
  const int duration_ms = static_cast<int>(std::floor(motion.duration() * 1000.0 + 0.5));
  SimulatedDrive drive;
  std::vector<Received<WheelMeasurement>> all_wheels;
  std::vector<Timestamp> image_stamps;
  const bool has_ticks = odometer_options.sensor == WheelSensor::kTicks;
  Random jitter(wheel_seed + 2);
  // The car reports its wheels before the recording starts and after it ends.
  for (int time_ms = -kMargin_ms; time_ms <= duration_ms + kMargin_ms; time_ms += kOdometryPeriod_ms) {
    if (faults.missing_ticks.isActive() && faults.missing_ticks.actsAt(std::chrono::milliseconds(time_ms))) {
      continue;
    }
    const double delay_s = odometer_options.latency_s + odometer_options.latency_jitter_s * jitter.uniform();
    Timestamp received = stampAt(time_ms) + durationFromSeconds(delay_s);
    received = all_wheels.empty() ? received : std::max(received, all_wheels.back().received);
    const auto add = [&](auto wheels, auto* recorded) {
      wheels.stamp = stampAt(time_ms);
      all_wheels.push_back({wheels, received});
      if (time_ms >= 0 && time_ms <= duration_ms) {
        recorded->push_back({wheels, received});
      }
    };
    if (has_ticks) {
      add(odometer.ticks(time_ms), &drive.wheel_ticks);
    } else {
      add(odometer.speeds(time_ms), &drive.wheel_speeds);
    }
  }
  for (int time_ms = 0; time_ms <= duration_ms; ++time_ms) {
    const bool is_image = time_ms % kImagePeriod_ms == kImageOffset_ms;
    const bool is_odometry = time_ms % kOdometryPeriod_ms == 0;
    if (is_image) {
      image_stamps.push_back(stampAt(time_ms));
      drive.world_from_vehicle.push_back({stampAt(time_ms), motion.at(time_ms).worldFromVehicle()});
      drive.image_motion.push_back(windowOf(motion, time_ms, reachOfImage_ms(faults)));
    }
    if (is_image || is_odometry) {
      const MotionSample& sample = motion.at(time_ms);
      VehicleOdometry truth;
      truth.stamp = stampAt(time_ms);
      truth.odom_from_vehicle = sample.worldFromVehicle();
      truth.forward_speed_m_per_s = sample.speed_m_per_s;
      truth.yaw_rate_rad_per_s = sample.speed_m_per_s * sample.curvature_per_m;
      drive.ground_truth.push_back(truth);
    }
  }
  std::optional<Timestamp> reset;
  if (faults.counter_reset.isActive() && has_ticks) {
    reset = stampAt(0) + durationFromSeconds(faults.counter_reset.time_s);
  }
  for (const Received<VehicleOdometry>& odometry :
       causalOdometry(all_wheels, image_stamps, stampAt(0), reset, motion_options)) {
    if (odometry.message.stamp <= stampAt(duration_ms)) {
      drive.odometry.push_back(odometry);
    }
  }
  return drive;
}

std::vector<RigidTransform> ownPoses(const SimulatedDrive& drive) {
  constexpr int64_t kPeriod_ns = 100'000'000;
  const Timestamp start = drive.ground_truth.front().stamp;
  std::vector<RigidTransform> poses;
  for (const VehicleOdometry& truth : drive.ground_truth) {
    if ((truth.stamp - start).count() % kPeriod_ns == 0) {
      poses.push_back(truth.odom_from_vehicle);
    }
  }
  return poses;
}

}  // namespace vcharge
