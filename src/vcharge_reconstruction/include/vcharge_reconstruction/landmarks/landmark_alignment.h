#pragma once

#include <cstdint>

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

struct LandmarkAlignmentOptions {
  VCHARGE_BEGIN_OPTIONS(LandmarkAlignmentOptions);
  VCHARGE_OPTION(double, sigma_px, 0.1, positive(),
                 "Deviation of the position that the patch is taken from.");
  VCHARGE_END_OPTIONS();
};

/// Aligns all observations of a landmark with one patch, because joined tracks follow different patches
/// and features are detected anew in each image, so that the observations show slightly different points:
/// a detected corner lies nearer to the middle of a thing the smaller the thing appears, which makes maps too
/// large. The patch comes from the image of median range and is warped by the poses and the rig. Landmarks
/// that no keyframe from `first_of_new` on observes are left as they are. Returns the number of aligned
/// observations. Data parallel, deterministic.
int64_t alignLandmarks(const LandmarkAlignmentOptions& options, const KeyframeImages& images,
                       ReconstructionData* data, int32_t first_of_new = 0);

}  // namespace vcharge
