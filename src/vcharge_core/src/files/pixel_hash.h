#pragma once

#include <opencv2/core.hpp>

#include "vcharge_core/files/content_hash.h"

namespace vcharge {

/// Adds the size and all pixels of an image of 32-bit floats with any number of channels; all NaNs are equal.
void addPixelsToHash(const cv::Mat& image, ContentHasher* hasher);

}  // namespace vcharge
