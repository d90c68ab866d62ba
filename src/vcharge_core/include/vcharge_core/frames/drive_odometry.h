#pragma once

#include <optional>

#include <Eigen/Core>

#include "vcharge_core/frames/frame_assembler_options.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Odometry of a drive, interpolated between its messages. Finds gaps and resets of the odometer, and bridges
/// resets by the velocities before them. Not thread safe.
class DriveOdometry {
 public:
  explicit DriveOdometry(const FrameAssemblerOptions& options);

  /// Uses known poses instead of odometry; add() is then ignored, and no frame waits for odometry.
  void setTrajectory(const Trajectory& odom_from_vehicle);
  bool isGiven() const { return is_given_; }
  /// Corrections are then counted as ignored messages.
  void ignoreCorrections() { takes_corrections_ = false; }

  /// Whether the stamp is so much older than the newest that the drive has started again.
  bool jumpsBack(Timestamp stamp) const;
  /// Adds a message; returns the break before it, if there is one. A message with the stamp of an earlier one
  /// replaces it, as when the driver's extrapolation to an image's stamp becomes known. Other messages that
  /// are not newer than the last are ignored. Both are counted.
  std::optional<DriveBreak> add(const VehicleOdometry& odometry, FrameCounters* counters);
  void clear();

  /// Whether the pose at this stamp is known or cannot become known any more.
  bool reaches(Timestamp stamp) const { return is_given_ || (last_ && last_->stamp >= stamp); }
  /// Pose as counted by the odometer; never interpolated over a reset.
  OdometryBuffer::Lookup lookup(Timestamp stamp) const;
  /// Pose in a frame without jumps: equal to lookup() up to the first reset.
  OdometryBuffer::Lookup lookupBridged(Timestamp stamp) const { return bridged_.lookup(stamp); }

  /// The last message; none after clear().
  const std::optional<VehicleOdometry>& last() const { return last_; }
  /// Change of x, y and yaw per second between the last two messages; none right after a break.
  const std::optional<Eigen::Vector3d>& velocity() const { return velocity_; }

 private:
  void correct(const VehicleOdometry& odometry, FrameCounters* counters);
  bool isReset(const VehicleOdometry& odometry) const;

  const FrameAssemblerOptions options_;
  OdometryBufferOptions buffer_options_;
  OdometryBuffer raw_, raw_before_reset_, bridged_;
  RigidTransform bridged_from_odom_;
  std::optional<VehicleOdometry> last_;
  std::optional<Eigen::Vector3d> velocity_;
  bool is_given_ = false;
  bool takes_corrections_ = true;
};

}  // namespace vcharge
