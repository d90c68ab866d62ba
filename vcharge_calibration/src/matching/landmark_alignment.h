#pragma once

#include <cstdint>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/matching/landmark_alignment_options.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

/// Tracks that were joined, by loops, between cameras, or where a patch had changed too much, each follow a
/// patch of their own, and features are found anew in every image: what was seen of a landmark is not of
/// quite the same point. Here every landmark gets one patch, of the image that saw it from the middle of the
/// distances, and all its observations are aligned with that, deformed as the poses and the rig say. Gives
/// the number of those that were. Data parallel, deterministic.
int64_t alignLandmarks(const LandmarkAlignmentOptions& options, const KeyframeImages& images,
                       MappingData* data);

}  // namespace vcharge
