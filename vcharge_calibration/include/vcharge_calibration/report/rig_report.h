#pragma once

#include <string>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// A calibration as one HTML page that needs nothing beside it: verdict, every degree of freedom with its
/// standard deviation, checks, sparse maps before and after the adjustment, the ground from above with its
/// seams before and after and what is uncertain there, landmarks that cameras share in rectified views,
/// errors over each image, loops and times. Pictures that need images are left out where there are none.
/// `more_sections` is HTML of its own that stands before the times.
std::string makeRigReport(const std::string& title, const RigCalibration& result, const MappingState& state,
                          const KeyframeImages& images = KeyframeImages(),
                          const std::string& more_sections = "");

}  // namespace vcharge
