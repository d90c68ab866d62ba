#pragma once

#include <vector>

#include <Eigen/Core>

#include "points/followed_points.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Unit rays of a followed point in the vehicle's axes, now and before.
struct RayPair {
  Eigen::Vector3d now, before;
};

/// The rays of all points that were observed at a stamp too.
std::vector<RayPair> rayPairsSince(Timestamp before, const std::vector<PointTrack>& tracks,
                                   const Eigen::Quaterniond& vehicle_from_camera);

/// Corrects the motion of the vehicle such that the points on the ground fit it, which wheel odometry alone
/// does within a few pixels only: the body pitches, rolls and heaves. Points that are not on the ground are
/// outliers. Gauss-Newton with a Cauchy kernel and priors that grow with the travel. `sigma_rad`: error of a
/// ray.
RigidTransform fitGroundMotion(const RigidTransform& before_from_now, const std::vector<RayPair>& points,
                               const Eigen::Vector3d& camera_in_vehicle_m, double sigma_rad);

}  // namespace vcharge
