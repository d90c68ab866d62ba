#pragma once

#include <cstdint>

#include "vcharge_calibration/matching/inter_camera_options.h"
#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

/// Looks for the landmarks that a camera saw in the images of its neighbours, now and within the next metres
/// (paper, section Inter-Camera Feature Matching): both images are rectified to the average rotation of the
/// two cameras, where the same patch looks alike, and the patch is aligned from where the rig and the poses
/// put it. Adds the observations to the tracks; gives their number. Data parallel, deterministic.
int64_t matchBetweenCameras(const InterCameraOptions& options, const KeyframeImages& images,
                            MappingData* data);

}  // namespace vcharge
