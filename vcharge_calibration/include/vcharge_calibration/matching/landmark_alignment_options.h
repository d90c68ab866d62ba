#pragma once

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Options of the alignment of all observations of a landmark with one image patch.
struct LandmarkAlignmentOptions {
  VCHARGE_BEGIN_OPTIONS(LandmarkAlignmentOptions);
  VCHARGE_OPTION(double, sigma_px, 0.3, positive(), "Deviation of an aligned position.");
  VCHARGE_OPTION(double, unaligned_sigma_px, 0.8, positive(), "Least deviation of other positions.");
  VCHARGE_END_OPTIONS();
};

}  // namespace vcharge
