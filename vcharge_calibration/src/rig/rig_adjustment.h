#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_reconstruction/mapping_data.h"

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
OdometryNoise estimateOdometryNoise(const RigAdjustmentOptions& options, const MappingData& data);

/// What is known beside the images.
struct RigPriors {
  OdometryNoise odometry;
  /// Where the landmarks are those of a finished map: how well each track's position is known, 1/m^2 along
  /// the map's axes; one per track. All keyframes are then free. Empty: the landmarks are unknown, the map's
  /// frame is that of the first keyframe's vehicle.
  std::vector<Eigen::Matrix3d> landmark_information;

  /// How well the cameras' mean height is known to be what it is before the adjustment; 0: not at all.
  double height_sigma_m = 0.0;

  bool hasMap() const { return !landmark_information.empty(); }
};

/// Adjusts cameras, keyframes, landmarks and the odometer's turn together (paper, equation joint_opt),
/// removes outliers; landmarks of a finished map stay as they are. Landmarks on the ground say where the
/// ground is under the vehicle: planar motion shows neither the cameras' heights nor, well, their tilt.
BundleAdjustmentSummary adjustRig(const RigAdjustmentOptions& options, const RigPriors& priors,
                                  MappingData* data);

/// What the adjusted data tell of the cameras: columns [dt, dphi] of each.
struct RigUncertainty {
  bool is_valid = false;
  Eigen::MatrixXd covariance;  ///< Schur marginals
  Eigen::MatrixXd jackknife;   ///< from how parts of the drive pull
};
RigUncertainty rigUncertainty(const RigAdjustmentOptions& options, const RigPriors& priors,
                              const MappingData& data);

}  // namespace vcharge
