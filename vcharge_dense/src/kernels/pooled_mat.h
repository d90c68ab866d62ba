#pragma once

#include <opencv2/core.hpp>

namespace vcharge {

/// A matrix with undefined values. Its memory is reused after release by the next matrix of the same size,
/// because new memory pages cost more time than filling them. At most 96 MB of unused memory are kept. Thread
/// safe.
cv::Mat pooledMat(cv::Size size, int type);

}  // namespace vcharge
