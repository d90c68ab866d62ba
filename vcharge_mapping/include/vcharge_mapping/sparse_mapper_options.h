#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/bundle_adjustment.h"
#include "vcharge_reconstruction/ego_motion.h"
#include "vcharge_reconstruction/reconstruction_options.h"

namespace vcharge {

/// Options of SparseMapper.
struct SparseMapperOptions : ReconstructionOptions {
  VCHARGE_BEGIN_DERIVED_OPTIONS(SparseMapperOptions, ReconstructionOptions);
  VCHARGE_OPTION_GROUP(EgoMotionOptions, ego_motion, {}, "Motion from frame to frame.");
  VCHARGE_OPTION_GROUP(BundleAdjustmentOptions, bundle, {}, "Adjustment of poses and landmarks.");
  VCHARGE_END_OPTIONS();
};

}  // namespace vcharge
