#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_rates.h"

namespace vcharge {

/// A point seen by a camera of the rig.
struct BundleObservation {
  int32_t pose = 0;
  int32_t camera = 0;
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
  double image_offset_s = 0.0;  ///< as in ImageMotion
};

/// A point that lies on the ground, at z = 0 in the vehicle's frame of a pose.
struct GroundObservation {
  int32_t point = 0;
  int32_t pose = 0;
  double sigma_m = 1.0;
};

/// Planar motion from the previous pose to `pose` as counted by the odometer, weighted as in
/// makeOdometryCost().
struct OdometerFactor {
  int32_t pose = 1;
  RigidTransform previous_from_current;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Logarithm of the magnification of a camera's image about its principal point, then its shift (px).
using ImageDeviation = Eigen::Vector3d;
/// Changes of a camera's readout time and clock offset (s).
using TimingDeviation = Eigen::Vector2d;

/// The unknowns of a bundle adjustment and the terms of its cost. Observations, of images and of the ground,
/// have a Cauchy loss; all other terms are quadratic.
struct BundleProblem {
  std::shared_ptr<const CameraRig> rig;

  // Unknowns, with their initial values.
  std::vector<RigidTransform> map_from_vehicle;
  bool is_first_pose_fixed = true;  ///< false if point_information fixes the map's frame
  std::vector<Eigen::Vector3d> points_in_map;
  Eigen::Vector2d odometer = Eigen::Vector2d::Ones();  ///< ratios of true to counted distance and turn
  std::vector<RigidTransform> vehicle_from_camera;     ///< one per camera; empty to use the rig's extrinsics
  /// How each camera's image deviates from that of the rig's model; empty to use the rig's intrinsics. Needs
  /// unknown extrinsics.
  std::vector<ImageDeviation> image_deviations;
  /// How each camera's timing deviates from the rig's; empty to use the rig's. Needs unknown extrinsics.
  std::vector<TimingDeviation> timing_deviations;

  /// Motion of the vehicle at each pose, while images are exposed. Empty: images are exposed at once.
  std::vector<VehicleRates> rates;

  // Terms.
  std::vector<BundleObservation> observations;         ///< grouped by point, ordered by pose within a point
  std::vector<size_t> first_observation;               ///< index per point, then the number of observations
  std::vector<GroundObservation> ground_observations;  ///< ordered by point, then by pose
  std::vector<OdometerFactor> odometer_factors;
  Eigen::Vector2d odometer_sigmas = Eigen::Vector2d::Ones();  ///< prior of `odometer`, around 1
  /// Prior of each point around its initial value, 1/m^2 along the map's axes. Empty: no prior.
  std::vector<Eigen::Matrix3d> point_information;
  /// Prior of the extrinsics around `prior_vehicle_from_camera`: information on [dt, dphi] of each camera in
  /// the vehicle's frame, all in one matrix. Empty: no prior.
  Eigen::MatrixXd extrinsics_information;
  std::vector<RigidTransform> prior_vehicle_from_camera;
  /// Prior of each of `image_deviations`, and its standard deviations.
  std::vector<ImageDeviation> prior_image_deviations, image_deviation_sigmas;
  /// Likewise of `timing_deviations`.
  std::vector<TimingDeviation> prior_timing_deviations, timing_deviation_sigmas;
  /// Deviation of the mean of all clock offsets, beside those of each: a shift of all against the odometer
  /// looks like cameras that are further in front.
  double common_clock_sigma_s = 1e-4;
  double loss_sigmas = 2.0;  ///< scale of the Cauchy loss

  size_t numFixedPoses() const { return is_first_pose_fixed ? 1 : 0; }
};

}  // namespace vcharge
