#pragma once

#include <cstdint>
#include <functional>

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/adjustment/odometry_noise.h"
#include "vcharge_reconstruction/bundle_solver.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

struct BundleAdjustmentOptions {
  VCHARGE_BEGIN_OPTIONS(BundleAdjustmentOptions);
  VCHARGE_OPTION(int, max_iterations, 50, atLeast(1), "Largest number of iterations.");
  VCHARGE_OPTION(double, cost_tolerance, 3e-4, positive(),
                 "Relative decrease of the cost that ends iterations.");
  VCHARGE_OPTION(double, outlier_sigmas, 4.0, positive(),
                 "Error of an observation that removes it, or, where small, lets it count little.");
  VCHARGE_OPTION(double, min_parallax_rad, 0.015, notNegative(),
                 "Least angle between two rays of a landmark.");
  VCHARGE_OPTION(int, min_observations, 3, atLeast(1), "Least observations of a landmark.");
  VCHARGE_OPTION(double, max_range_m, 80.0, positive(),
                 "Largest distance of a landmark from the nearest camera.");
  VCHARGE_OPTION(double, odometer_scale_sigma, 0.03, positive(),
                 "Prior deviation of true over counted distance.");
  VCHARGE_OPTION(double, odometer_turn_sigma, 0.05, positive(), "Prior deviation of true over counted turn.");
  VCHARGE_OPTION(double, odometry_distance_sigma, 0.005, notNegative(), "Relative deviation of a distance.");
  VCHARGE_OPTION(double, odometry_sigma_m, 0.005, positive(), "Constant deviation of a distance.");
  VCHARGE_OPTION(double, odometry_turn_sigma, 0.02, notNegative(), "Relative deviation of a turn.");
  VCHARGE_OPTION(double, odometry_sigma_rad, 0.002, positive(), "Constant deviation of a turn.");
  VCHARGE_OPTION(double, height_sigma_m, 0.02, positive(), "Change of height between keyframes.");
  VCHARGE_OPTION(double, tilt_sigma_rad, 0.01, positive(), "Change of roll and pitch between keyframes.");
  VCHARGE_END_OPTIONS();
};

struct BundleAdjustmentSummary {
  bool converged = false;
  int num_iterations = 0;
  int64_t num_observations = 0;  ///< observations that were kept
  int64_t num_removed_observations = 0;
  int64_t num_removed_landmarks = 0;
  double rms_px = 0.0;  ///< error per coordinate of the observations that were kept
};

/// Adjusts the keyframes (six degrees of freedom; the first is fixed), the landmarks and the odometer's
/// factors so that the robust sum of reprojection and odometry errors is least, with fixed extrinsics. Calls
/// removeOutliers() at the end. The options' deviations of the odometry count where its noise is not known.
BundleAdjustmentSummary adjustBundle(const BundleAdjustmentOptions& options, ReconstructionData* data,
                                     const OdometryNoise& odometry = {});

// The steps of adjustBundle(), for adjustments with further terms.

/// The problem with the observations of the landmarks and the odometer factors between keyframes.
BundleProblem makeBundleProblem(const BundleAdjustmentOptions& options, const ReconstructionData& data,
                                const OdometryNoise& odometry);
/// The noise as estimated from adjusted keyframes, and at most what the options assume of a short motion.
OdometryNoise estimateOdometryNoise(const BundleAdjustmentOptions& options, const ReconstructionData& data);
/// Copies poses, points and the odometer's factors of a problem of makeBundleProblem() back to the data.
void writeBack(const BundleProblem& problem, ReconstructionData* data);
/// Projected minus observed position of a landmark. False if the camera does not project it.
bool reprojectionError(const ReconstructionData& data, const Track& track,
                       const TrackObservation& observation, Eigen::Vector2d* error_px);
/// Removes observations and landmarks that do not fit the current poses, and lets observations that err more
/// than their deviation says, but little, count less; computes the covariance of the remaining landmarks for
/// fixed poses.
BundleAdjustmentSummary removeOutliers(const BundleAdjustmentOptions& options, ReconstructionData* data);

}  // namespace vcharge
