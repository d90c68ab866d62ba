#pragma once

#include <string>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// A calibration as one self-contained HTML page: verdict, every degree of freedom with its standard
/// deviation, checks, sparse maps before and after the adjustment, the ground from above with its seams
/// before and after, common landmarks in rectified views, errors over each image, loops and times. Pictures
/// of missing images are left out. `more_sections` is HTML that stands before the times.
std::string makeRigReport(const std::string& title, const RigCalibration& result,
                          const ReconstructionState& state, const KeyframeImages& images = KeyframeImages(),
                          const std::string& more_sections = "");

}  // namespace vcharge
