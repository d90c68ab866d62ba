#pragma once

#include <cstdint>

#include "vcharge_calibration/matching/inter_camera_options.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Searches for each camera's landmarks in the images that its neighbours take within the next metres (paper,
/// section Inter-Camera Feature Matching): both images are rectified to the mean rotation of the two cameras,
/// where patches look alike, and the patch is aligned from its predicted position. Adds the observations to
/// the tracks and returns their number. Searches in keyframes from `first_of_new` on. Data parallel,
/// deterministic.
int64_t matchBetweenCameras(const InterCameraOptions& options, const KeyframeImages& images,
                            ReconstructionData* data, size_t first_of_new = 0);

}  // namespace vcharge
