#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// 8-bit gray pixels (CV_8UC1), which are never written to. `owner` keeps the memory alive if `pixels` is a
/// view of a message's buffer; copying an Image copies no pixels.
struct Image {
  cv::Mat pixels;
  std::shared_ptr<const void> owner;
};

/// The images of all cameras of a rig at one instant, in the rig's camera order. Missing images have no
/// pixels.
struct MultiFrame {
  Timestamp stamp;
  std::vector<Image> images;
};

}  // namespace vcharge
