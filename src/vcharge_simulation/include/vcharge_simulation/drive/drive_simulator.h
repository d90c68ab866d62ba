#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_simulation/sensors/wheel_odometer.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// All of a drive but its images.
struct SimulatedDrive {
  Trajectory world_from_vehicle;              ///< truth at every image's stamp
  std::vector<VehicleOdometry> ground_truth;  ///< truth (in the world frame) at every odometry stamp
  std::vector<VehicleOdometry> odometry;      ///< 50 Hz, and at every image's stamp
  std::vector<WheelTicks> wheel_ticks;        ///< 50 Hz
  /// world_from_vehicle at the renderings that make each image; empty without motion blur.
  std::vector<std::vector<RigidTransform>> exposure_poses;
};

/// Simulates a drive along a path: images every 80 ms, 7 ms after an odometry sample. `road_seed` shakes the
/// car, `wheel_seed` sets where in a tick the wheels stand at the start. Of the faults, those of wheels,
/// counters and suspension act, and the poses for motion blur are given; stamps are the true ones. The same
/// arguments give the same bits. std::invalid_argument for bad options.
SimulatedDrive simulateDrive(const DrivePath& path, const VehicleMotionOptions& motion_options,
                             const WheelOdometerOptions& odometer_options, uint64_t road_seed,
                             uint64_t wheel_seed, const FaultOptions& faults = FaultOptions(),
                             const GroundHeight& ground_height = nullptr);

}  // namespace vcharge
