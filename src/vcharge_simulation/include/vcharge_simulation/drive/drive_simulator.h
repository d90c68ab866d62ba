#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_simulation/sensors/wheel_odometer.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// Everything recorded on a drive except the images.
struct SimulatedDrive {
  Trajectory world_from_vehicle;  ///< true pose at every image stamp
  std::vector<VehicleOdometry>
      ground_truth;  ///< true pose in the world frame at every odometry and image stamp
  std::vector<Received<VehicleOdometry>> odometry;  ///< in order of reception, see causalOdometry()
  std::vector<Received<WheelTicks>> wheel_ticks;    ///< at 50 Hz, in order of reception
  /// Poses of the renderings that are averaged into each image; empty without motion blur.
  std::vector<std::vector<RigidTransform>> exposure_poses;
};

/// Simulates a drive along a path. Images come every 80 ms, 7 ms after an odometry sample. `road_seed`
/// selects the road roughness, `wheel_seed` the phase of the wheel counters at the start. Applies the faults
/// of wheels, counters and suspension, and returns the poses for motion blur; all stamps are the true ones.
/// The same arguments give bit-identical results. Throws std::invalid_argument for invalid options.
SimulatedDrive simulateDrive(const DrivePath& path, const VehicleMotionOptions& motion_options,
                             const WheelOdometerOptions& odometer_options, uint64_t road_seed,
                             uint64_t wheel_seed, const FaultOptions& faults = FaultOptions(),
                             const GroundHeight& ground_height = nullptr);

}  // namespace vcharge
