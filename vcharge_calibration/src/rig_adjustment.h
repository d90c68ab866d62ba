#pragma once

#include <Eigen/Core>

#include "vcharge_calibration/rig_calibrator_options.h"
#include "vcharge_mapping/mapping_data.h"

namespace vcharge {

/// Adjusts cameras, keyframes, landmarks and the odometer's turn together (paper, equation joint_opt), removes
/// outliers. Landmarks on the ground say where the ground is under the vehicle: planar motion shows neither
/// the cameras' heights nor, well, their tilt.
BundleAdjustmentSummary adjustRig(const RigCalibratorOptions& options, MappingData* data);

/// What the adjusted data tell of the cameras: columns [dt, dphi] of each.
struct RigUncertainty {
  bool is_valid = false;
  Eigen::MatrixXd covariance;  ///< Schur marginals
  Eigen::MatrixXd jackknife;   ///< from how parts of the drive pull
};
RigUncertainty rigUncertainty(const RigCalibratorOptions& options, const MappingData& data);

}  // namespace vcharge
