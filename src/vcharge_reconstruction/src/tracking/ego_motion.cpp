#include "vcharge_reconstruction/ego_motion.h"

#include <cmath>

#include <Eigen/LU>

namespace vcharge {
namespace {

/// How much less certain the odometer is where the wheels slip.
constexpr double kSlipFactor = 20.0;

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

/// A motion whose length is not observable gets the odometer's, with a deviation that makes it count for
/// nothing.
PlanarMotion visualMotion(const MotionEstimate& estimate, const PlanarMotion& odometry,
                          const EgoMotionOptions& options) {
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
  const double slip_squared = options.side_slip_sigma_m * options.side_slip_sigma_m;
  result.covariance.diagonal() += Eigen::Vector3d(slip_squared, slip_squared, 1e-10);
  return result;
}

Eigen::Vector3d fuse(const PlanarMotion& a, const PlanarMotion& b) {
  const Eigen::Matrix3d information_a = a.covariance.inverse();
  const Eigen::Matrix3d information_b = b.covariance.inverse();
  return (information_a + information_b).inverse() * (information_a * a.value + information_b * b.value);
}

}  // namespace

RobustOptions EgoMotionOptions::defaultRobust() {
  RobustOptions options;
  options.max_error_rad = 0.002;
  options.max_iterations = 200;
  options.min_inliers = 15;
  return options;
}

void EgoMotionOptions::validate() const {
  validateInner("robust", robust);
  requireField(min_matches >= 5, "min_matches", "must be 5 or more", min_matches);
  requireField(odometry_distance_sigma > 0.0, "odometry_distance_sigma", "must be positive",
               odometry_distance_sigma);
  requireField(odometry_sigma_m > 0.0, "odometry_sigma_m", "must be positive", odometry_sigma_m);
  requireField(odometry_turn_sigma > 0.0, "odometry_turn_sigma", "must be positive", odometry_turn_sigma);
  requireField(odometry_sigma_rad > 0.0, "odometry_sigma_rad", "must be positive", odometry_sigma_rad);
  requireField(side_slip_sigma_m > 0.0, "side_slip_sigma_m", "must be positive", side_slip_sigma_m);
  requireField(min_gain >= 1.0, "min_gain", "must be 1 or more", min_gain);
}

EgoMotion estimateEgoMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& odometry_previous_from_current,
                            const EgoMotionOptions& options) {
  EgoMotion result;
  result.previous_from_current = odometry_previous_from_current;
  result.is_inlier.assign(matches.size(), true);
  if (static_cast<int>(matches.size()) < options.min_matches) {
    return result;
  }
  MotionEstimate best = estimateAckermannMotion(matches, options.robust);
  MotionHypothesis hypothesis = MotionHypothesis::kAckermann;
  const auto adopt = [&](const MotionEstimate& estimate, MotionHypothesis other) {
    const double needed = isUsable(best) ? options.min_gain * static_cast<double>(best.inliers.size()) : 0.0;
    if (isUsable(estimate) && static_cast<double>(estimate.inliers.size()) > needed) {
      best = estimate;
      hypothesis = other;
    }
  };
  const auto canGain = [&] {
    return !isUsable(best) ||
           options.min_gain * static_cast<double>(best.inliers.size()) < static_cast<double>(matches.size());
  };
  if (canGain()) {
    adopt(estimatePlanarMotion(matches, options.robust), MotionHypothesis::kPlanar);
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
    adopt(refineMotion(matches, initial, options.robust), MotionHypothesis::kSpatial);
  }
  if (!isUsable(best)) {
    return result;
  }
  PlanarMotion odometry = odometryMotion(odometry_previous_from_current, options);
  if (hypothesis == MotionHypothesis::kPlanar) {
    odometry.covariance *= kSlipFactor * kSlipFactor;  // wheels that slip count wrongly
  }
  const Eigen::Vector3d fused = fuse(visualMotion(best, odometry, options), odometry);
  result.hypothesis = hypothesis;
  const RigidTransform planar = RigidTransform::planar(fused.x(), fused.y(), fused.z());
  result.previous_from_current = planar;
  if (hypothesis == MotionHypothesis::kSpatial) {
    // The rest of the motion, which the odometer does not see, stays as the images show it.
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
