#pragma once

#include <opencv2/core.hpp>

namespace vcharge {

/// A matrix whose values are undefined and whose memory, once it is released, serves the next one of its
/// size, on any thread: the images of a sweep come and go in the same sizes, and fresh pages cost more time
/// than what is written into them. A bounded amount of memory is kept.
cv::Mat pooledMat(cv::Size size, int type);

}  // namespace vcharge
