#pragma once

#include <Eigen/Core>

#include "vcharge_calibration/rig_calibrator_options.h"
#include "vcharge_mapping/mapping_data.h"

namespace vcharge {

/// Adjusts cameras, keyframes, landmarks and the odometer's turn together (paper, equation joint_opt), removes
/// outliers. The rig's mean height and tilt stay: what is seen does not tell them; see ground.h.
BundleAdjustmentSummary adjustRig(const BundleAdjustmentOptions& options, MappingData* data);

/// What the adjusted data tell of the cameras: columns [dt, dphi] of each.
struct RigUncertainty {
  bool is_valid = false;
  Eigen::MatrixXd covariance;  ///< Schur marginals
  Eigen::MatrixXd jackknife;   ///< from how parts of the drive of this length pull
};
RigUncertainty rigUncertainty(const BundleAdjustmentOptions& options, double segment_m,
                              const MappingData& data);

}  // namespace vcharge
