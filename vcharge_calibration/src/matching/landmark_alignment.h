#pragma once

#include <cstdint>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/matching/landmark_alignment_options.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Aligns all observations of a landmark with one patch, because joined tracks follow different patches
/// and features are detected anew in each image, so that the observations show slightly different points.
/// The patch comes from the image of median range and is warped by the poses and the rig. Returns the number
/// of aligned observations. Data parallel, deterministic.
int64_t alignLandmarks(const LandmarkAlignmentOptions& options, const KeyframeImages& images,
                       ReconstructionData* data);

}  // namespace vcharge
