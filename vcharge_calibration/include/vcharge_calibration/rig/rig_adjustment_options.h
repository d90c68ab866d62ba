#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/bundle_adjustment.h"

namespace vcharge {

/// Options of the joint adjustment of extrinsics, poses and landmarks. The common error is the part that is
/// equal in all parts of a drive, so that a jackknife cannot measure it: patches that look different from
/// other directions, and lenses that deviate from their models.
struct RigAdjustmentOptions {
  VCHARGE_BEGIN_OPTIONS(RigAdjustmentOptions);
  VCHARGE_OPTION(double, max_ground_distance_m, 0.05, positive(), "Height below which a landmark is ground.");
  VCHARGE_OPTION(double, ground_sigma_m, 0.1, positive(), "Deviation of the ground from a plane.");
  VCHARGE_OPTION(bool, refine_intrinsics, false, anyValue(),
                 "Also adjust focal lengths and principal points, which heat changes.");
  VCHARGE_OPTION(bool, refine_timing, false, anyValue(),
                 "Also adjust readout times and clock offsets of the cameras.");
  VCHARGE_OPTION(double, common_error_px, 0.01, notNegative(), "Deviation of directions by common errors.");
  VCHARGE_OPTION(double, scale_sigma, 0.005, notNegative(),
                 "Relative deviation of the odometer's scale, which the rig takes over.");
  VCHARGE_OPTION_GROUP(BundleAdjustmentOptions, bundle, {}, "Bundle adjustment.");
  VCHARGE_END_OPTIONS();
};

}  // namespace vcharge
