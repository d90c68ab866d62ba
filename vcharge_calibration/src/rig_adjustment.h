#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/rig_calibrator_options.h"
#include "vcharge_mapping/mapping_data.h"

namespace vcharge {

/// How well the odometer counts the motion from a keyframe to the next, and how planar it is, as far as the
/// adjusted keyframes can tell.
struct OdometryNoise {
  double sigma_m = 0.0;  ///< 0: not known, the options' deviations hold
  double sigma_rad = 0.0;
  double height_sigma_m = 0.0;    ///< how far the vehicle leaves the plane of its motion
  double tilt_sigma_rad = 0.0;    ///< and turns out of it
  std::vector<bool> has_slipped;  ///< by the later keyframe: far off, counts for little
};
/// From keyframes that were adjusted with loose odometry: an upper bound, since it has their own errors too.
OdometryNoise estimateOdometryNoise(const RigCalibratorOptions& options, const MappingData& data);

/// Adjusts cameras, keyframes, landmarks and the odometer's turn together (paper, equation joint_opt),
/// removes outliers. Landmarks on the ground say where the ground is under the vehicle: planar motion shows
/// neither the cameras' heights nor, well, their tilt.
BundleAdjustmentSummary adjustRig(const RigCalibratorOptions& options, const OdometryNoise& odometry,
                                  MappingData* data);

/// What the adjusted data tell of the cameras: columns [dt, dphi] of each.
struct RigUncertainty {
  bool is_valid = false;
  Eigen::MatrixXd covariance;  ///< Schur marginals
  Eigen::MatrixXd jackknife;   ///< from how parts of the drive pull
};
RigUncertainty rigUncertainty(const RigCalibratorOptions& options, const OdometryNoise& odometry,
                              const MappingData& data);

}  // namespace vcharge
