#pragma once

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Options of the search for landmarks of one camera in the images of its neighbours.
struct InterCameraOptions {
  VCHARGE_BEGIN_OPTIONS(InterCameraOptions);
  VCHARGE_OPTION(double, history_m, 3.0, notNegative(), "Travel since the other camera saw the landmark.");
  VCHARGE_OPTION(int, keyframe_step, 2, atLeast(1), "Searches every so many keyframes.");
  VCHARGE_OPTION(int, min_overlap, 15, atLeast(1), "Least landmarks that both images should show.");
  VCHARGE_OPTION(double, sigma_px, 0.5, positive(), "Deviation of a matched position.");
  VCHARGE_END_OPTIONS();
};

}  // namespace vcharge
