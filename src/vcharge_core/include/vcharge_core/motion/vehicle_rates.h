#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Motion of the centre of the rear axle over `distance_m` along a circular arc that turns by `turn_rad`
/// (positive to the left), starting along x. Exact, also for straight lines.
RigidTransform arcMotion(double distance_m, double turn_rad);

/// Motion of the vehicle around an instant: along a circular arc at constant speed.
struct VehicleRates {
  double forward_speed_m_per_s = 0.0;
  double yaw_rate_rad_per_s = 0.0;

  /// Pose of the vehicle a time after the instant, in its frame at the instant.
  RigidTransform motionAfter(double time_s) const {
    return arcMotion(forward_speed_m_per_s * time_s, yaw_rate_rad_per_s * time_s);
  }
  /// Velocity of a point that moves with the vehicle, in the vehicle's frame.
  Eigen::Vector3d velocityOf(const Eigen::Vector3d& point_m) const {
    return {forward_speed_m_per_s - yaw_rate_rad_per_s * point_m.y(), yaw_rate_rad_per_s * point_m.x(), 0.0};
  }
};

/// Motion of the vehicle around the stamp of a frame, for an image with a stamp of its own.
struct ImageMotion {
  VehicleRates rates;
  double offset_s = 0.0;  ///< the image's stamp minus the frame's
};

/// Motion of the vehicle around the stamp of a frame.
struct FrameMotion {
  VehicleRates rates;
  std::vector<double> image_offsets_s;  ///< per camera, see ImageMotion; empty: all stamps are the frame's

  double offsetOf(size_t camera) const { return image_offsets_s.empty() ? 0.0 : image_offsets_s.at(camera); }
  ImageMotion of(size_t camera) const { return {rates, offsetOf(camera)}; }
};

}  // namespace vcharge
