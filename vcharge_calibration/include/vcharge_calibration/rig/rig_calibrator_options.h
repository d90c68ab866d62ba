#pragma once

#include "vcharge_calibration/initialization/hand_eye.h"
#include "vcharge_calibration/matching/inter_camera_options.h"
#include "vcharge_calibration/rig/rig_adjustment_options.h"
#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/reconstruction_options.h"

namespace vcharge {

/// Options of RigCalibrator.
struct RigCalibratorOptions : ReconstructionOptions {
  VCHARGE_BEGIN_DERIVED_OPTIONS(RigCalibratorOptions, ReconstructionOptions);
  VCHARGE_OPTION_GROUP(HandEyeOptions, hand_eye, {}, "Initial extrinsics of each camera.");
  VCHARGE_OPTION_GROUP(InterCameraOptions, inter_camera, {}, "Matches between neighbouring cameras.");
  VCHARGE_OPTION_GROUP(RigAdjustmentOptions, adjustment, defaultAdjustment(), "Joint adjustment.");
  VCHARGE_END_OPTIONS();

  /// The odometer's distance defines the scale.
  static RigAdjustmentOptions defaultAdjustment();

  /// Triangulation before the first adjustment; tolerates larger reprojection errors.
  TriangulationOptions firstTriangulation() const;
};

}  // namespace vcharge
