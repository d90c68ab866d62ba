#include "vcharge_reconstruction/ego_motion.h"

#include <cmath>

#include <Eigen/LU>

#include "vcharge_geometry/robust/motion_estimation.h"

namespace vcharge {
namespace {

/// Factor on the odometer's deviation where the wheels slip.
constexpr double kSlipFactor = 20.0;
/// With fewer matches the odometer alone gives the motion.
constexpr int kMinMatches = 30;
/// A less constrained motion model is used only if it explains this many times the matches, as it fits noise
/// better.
constexpr double kMinGain = 1.1;
/// Deviation of real wheels from the Ackermann model.
constexpr double kSideSlipSigma_m = 0.002;

RobustOptions robustOptions() {
  RobustOptions options;
  options.max_error_rad = 0.002;
  options.max_iterations = 200;
  options.min_inliers = 15;
  return options;
}

/// x, y (metres) and yaw (radians) of a motion, and their covariance.
struct PlanarMotion {
  Eigen::Vector3d value;
  Eigen::Matrix3d covariance;
};

Eigen::Vector3d planarPart(const RigidTransform& transform) {
  return {transform.translation().x(), transform.translation().y(), yawOfRotation(transform.rotation())};
}

PlanarMotion odometryMotion(const RigidTransform& motion, const EgoMotionOptions& options) {
  PlanarMotion result;
  result.value = planarPart(motion);
  const double distance_m = result.value.head<2>().norm();
  const double sigma_m = options.odometry_sigma_m + options.odometry_distance_sigma * distance_m;
  const double sigma_rad =
      options.odometry_sigma_rad + options.odometry_turn_sigma * std::abs(result.value.z());
  result.covariance =
      Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  return result;
}

/// Planar part of a motion in the images. If its length is not observable, it has the odometer's, with a
/// standard deviation that gives it no weight.
PlanarMotion visualMotion(const MotionEstimate& estimate, const PlanarMotion& odometry) {
  const int rows[] = {0, 1, 5};
  PlanarMotion result;
  result.value = planarPart(estimate.previous_from_current);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      result.covariance(i, j) = estimate.covariance(rows[i], rows[j]);
    }
  }
  if (estimate.status == EstimationStatus::kScaleUnobservable) {
    const double length_m = odometry.value.head<2>().norm();
    const Eigen::Vector2d direction = result.value.head<2>();
    result.value.head<2>() *= length_m;
    result.covariance.topLeftCorner<2, 2>() *= length_m * length_m;
    result.covariance.topRightCorner<2, 1>() *= length_m;
    result.covariance.bottomLeftCorner<1, 2>() *= length_m;
    result.covariance.topLeftCorner<2, 2>() += direction * direction.transpose();
  }
  const double slip_squared = kSideSlipSigma_m * kSideSlipSigma_m;
  result.covariance.diagonal() += Eigen::Vector3d(slip_squared, slip_squared, 1e-10);
  return result;
}

Eigen::Vector3d fuse(const PlanarMotion& a, const PlanarMotion& b) {
  const Eigen::Matrix3d information_a = a.covariance.inverse();
  const Eigen::Matrix3d information_b = b.covariance.inverse();
  return (information_a + information_b).inverse() * (information_a * a.value + information_b * b.value);
}

}  // namespace

EgoMotion estimateEgoMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& odometry_previous_from_current,
                            const EgoMotionOptions& options) {
  EgoMotion result;
  result.previous_from_current = odometry_previous_from_current;
  result.is_inlier.assign(matches.size(), true);
  if (static_cast<int>(matches.size()) < kMinMatches) {
    return result;
  }
  const RobustOptions robust = robustOptions();
  MotionEstimate best = estimateAckermannMotion(matches, robust);
  MotionHypothesis hypothesis = MotionHypothesis::kAckermann;
  const auto adopt = [&](const MotionEstimate& estimate, MotionHypothesis other) {
    const double needed = isUsable(best) ? kMinGain * static_cast<double>(best.inliers.size()) : 0.0;
    if (isUsable(estimate) && static_cast<double>(estimate.inliers.size()) > needed) {
      best = estimate;
      hypothesis = other;
    }
  };
  const auto canGain = [&] {
    return !isUsable(best) ||
           kMinGain * static_cast<double>(best.inliers.size()) < static_cast<double>(matches.size());
  };
  if (canGain()) {
    adopt(estimatePlanarMotion(matches, robust), MotionHypothesis::kPlanar);
  }
  if (canGain()) {
    RigidTransform initial = odometry_previous_from_current;
    if (isUsable(best)) {
      initial = best.previous_from_current;
      if (best.status == EstimationStatus::kScaleUnobservable) {
        initial = RigidTransform(initial.rotation(),
                                 initial.translation() * odometry_previous_from_current.translation().norm());
      }
    }
    adopt(refineMotion(matches, initial, robust), MotionHypothesis::kSpatial);
  }
  if (!isUsable(best)) {
    return result;
  }
  PlanarMotion odometry = odometryMotion(odometry_previous_from_current, options);
  if (hypothesis == MotionHypothesis::kPlanar) {
    odometry.covariance *= kSlipFactor * kSlipFactor;  // slipping wheels count a wrong distance
  }
  const Eigen::Vector3d fused = fuse(visualMotion(best, odometry), odometry);
  result.hypothesis = hypothesis;
  const RigidTransform planar = RigidTransform::planar(fused.x(), fused.y(), fused.z());
  result.previous_from_current = planar;
  if (hypothesis == MotionHypothesis::kSpatial) {
    // The odometer does not measure height, roll and pitch: they come from the images alone.
    const RigidTransform& seen = best.previous_from_current;
    const Eigen::Quaterniond turn = rotationFromYawPitchRoll(yawOfRotation(seen.rotation()), 0.0, 0.0);
    double height_m = seen.translation().z();
    if (best.status == EstimationStatus::kScaleUnobservable) {
      height_m *= odometry.value.head<2>().norm();
    }
    result.previous_from_current = RigidTransform(planar.rotation() * (turn.conjugate() * seen.rotation()),
                                                  Eigen::Vector3d(fused.x(), fused.y(), height_m));
  }
  std::fill(result.is_inlier.begin(), result.is_inlier.end(), false);
  for (const int inlier : best.inliers) {
    result.is_inlier[inlier] = true;
  }
  return result;
}

}  // namespace vcharge
