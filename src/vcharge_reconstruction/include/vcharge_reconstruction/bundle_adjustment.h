#pragma once

#include <cstdint>
#include <functional>

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/bundle_solver.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

struct BundleAdjustmentOptions {
  int max_iterations = 25;
  double cost_tolerance = 3e-3;        ///< relative decrease of the cost that ends the iterations
  double loss_sigmas = 2.0;            ///< scale of the Cauchy loss
  double outlier_sigmas = 4.0;         ///< observations with larger errors are removed
  double min_parallax_rad = 0.015;     ///< landmarks whose remaining rays are more parallel are removed
  int min_observations = 3;            ///< landmarks with fewer are removed; 1 for those of a finished map
  double max_range_m = 80.0;           ///< and those that are further from every camera
  double odometer_scale_sigma = 0.03;  ///< of true over counted distance, before the drive
  double odometer_turn_sigma = 0.05;   ///< of true over counted turn
  // What the odometer's motions between keyframes are good for.
  double odometry_distance_sigma = 0.005;  ///< of the distance
  double odometry_sigma_m = 0.005;         ///< besides
  double odometry_turn_sigma = 0.02;       ///< of the turn
  double odometry_sigma_rad = 0.002;       ///< besides
  double height_sigma_m = 0.02;            ///< the odometer sees neither height
  double tilt_sigma_rad = 0.01;            ///< nor roll and pitch: how much they change between keyframes

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_iterations", max_iterations);
    visit("cost_tolerance", cost_tolerance);
    visit("loss_sigmas", loss_sigmas);
    visit("outlier_sigmas", outlier_sigmas);
    visit("min_parallax_rad", min_parallax_rad);
    visit("min_observations", min_observations);
    visit("max_range_m", max_range_m);
    visit("odometer_scale_sigma", odometer_scale_sigma);
    visit("odometer_turn_sigma", odometer_turn_sigma);
    visit("odometry_distance_sigma", odometry_distance_sigma);
    visit("odometry_sigma_m", odometry_sigma_m);
    visit("odometry_turn_sigma", odometry_turn_sigma);
    visit("odometry_sigma_rad", odometry_sigma_rad);
    visit("height_sigma_m", height_sigma_m);
    visit("tilt_sigma_rad", tilt_sigma_rad);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

struct BundleAdjustmentSummary {
  bool converged = false;
  int num_iterations = 0;
  int64_t num_observations = 0;
  int64_t num_removed_observations = 0;
  int64_t num_removed_landmarks = 0;
  double rms_px = 0.0;  ///< of the observations that were kept, per coordinate
};

/// Moves the keyframes (six degrees of freedom; the first is held), the landmarks, and the odometer's scale
/// and turn factors to the least robust sum of reprojection and odometry errors; the rig is known. Then
/// removes outliers and gives the landmarks their covariance, given the poses.
BundleAdjustmentSummary adjustBundle(const BundleAdjustmentOptions& options, MappingData* data);

// The parts of adjustBundle(), for those who adjust more than it does.

/// The landmarks' observations and the odometer's motions, as the solver wants them.
BundleProblem makeBundleProblem(const BundleAdjustmentOptions& options, const MappingData& data);
/// Poses, points and odometer's factors back to where makeBundleProblem() took them from.
void writeBack(const BundleProblem& problem, MappingData* data);
/// Removes what does not fit the poses and points as they are now; gives landmarks their covariance.
BundleAdjustmentSummary removeOutliers(const BundleAdjustmentOptions& options, MappingData* data);

}  // namespace vcharge
