#pragma once

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/keyframe_builder.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Options of MapRigCalibrator.
struct MapRigCalibratorOptions : KeyframeOptions {
  VCHARGE_BEGIN_DERIVED_OPTIONS(MapRigCalibratorOptions, KeyframeOptions);
  VCHARGE_OPTION(double, landmark_sigma_m, 0.005, positive(),
                 "Standard deviation of landmarks, added to their covariance.");
  VCHARGE_OPTION(double, height_sigma_m, 0.02, positive(), "Deviation of the ground from that of the map.");
  VCHARGE_OPTION(double, feature_sigma_px, 0.6, positive(), "Deviation of a feature's position.");
  VCHARGE_OPTION_GROUP(HandEyeOptions, hand_eye, {}, "Initial extrinsics of each camera.");
  VCHARGE_OPTION_GROUP(MapLocalizerOptions, localizer, {}, "Localization of each camera in the map.");
  VCHARGE_OPTION_GROUP(RigAdjustmentOptions, adjustment, defaultAdjustment(), "Joint adjustment.");
  VCHARGE_END_OPTIONS();

  /// The map defines the scale. A landmark may have a single observation in the drive.
  static RigAdjustmentOptions defaultAdjustment();
};

}  // namespace vcharge
