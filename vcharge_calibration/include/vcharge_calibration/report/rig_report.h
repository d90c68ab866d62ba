#pragma once

#include <string>

#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Makes a self-contained HTML page of a calibration: verdict, every degree of freedom with its standard
/// deviation, checks, sparse maps before and after the adjustment, the ground from above with its seams
/// before and after, common landmarks in rectified views, errors over each image, loops and times. Leaves out
/// pictures that need missing images. `more_sections` is HTML that is inserted before the times.
std::string makeRigReport(const std::string& title, const RigCalibration& result,
                          const ReconstructionState& state, const KeyframeImages& images = KeyframeImages(),
                          const std::string& more_sections = "");

}  // namespace vcharge
