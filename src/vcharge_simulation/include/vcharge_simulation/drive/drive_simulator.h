#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_simulation/sensors/wheel_odometer.h"
#include "vcharge_simulation/vehicle/motion_window.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// Everything recorded on a drive except the images.
struct SimulatedDrive {
  Trajectory world_from_vehicle;  ///< true pose at every image stamp
  /// True poses in the world frame, and velocities, at every odometry and image stamp.
  std::vector<VehicleOdometry> ground_truth;
  std::vector<Received<VehicleOdometry>> odometry;  ///< in order of reception, see causalOdometry()
  /// At 50 Hz, in order of reception; one of them is empty, see WheelOdometerOptions::sensor.
  std::vector<Received<WheelTicks>> wheel_ticks;
  std::vector<Received<WheelSpeeds>> wheel_speeds;
  std::vector<MotionWindow> image_motion;  ///< for each image, over its exposure and readout
};

/// Simulates a drive along a path on ground of this height. Images come every 80 ms, 7 ms after an odometry
/// sample, so that no image has the stamp of a regular odometry message. `road_seed` selects the road's
/// roughness, `wheel_seed` the phase of the wheel counters at the start. Applies the faults of wheels,
/// counters and suspension; all stamps are the true ones, since faults of clocks and messages are applied
/// when the drive is recorded. The same arguments give bit-identical results. Throws std::invalid_argument
/// for bad options.
SimulatedDrive simulateDrive(const DrivePath& path, const VehicleMotionOptions& motion_options,
                             const WheelOdometerOptions& odometer_options, uint64_t road_seed,
                             uint64_t wheel_seed, const FaultOptions& faults = FaultOptions(),
                             const GroundHeight& ground_height = nullptr);

/// True poses every 0.1 s, for SceneOptions::own_poses.
std::vector<RigidTransform> ownPoses(const SimulatedDrive& drive);

}  // namespace vcharge
