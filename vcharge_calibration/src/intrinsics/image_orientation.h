#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "intrinsics/intrinsic_optimizer.h"

namespace vcharge {

/// An image that shows the camera's picture mirrored or turned.
struct TurnedImage {
  std::string image;
  std::string how;  ///< "mirrored left-right", "mirrored up-down", "turned by 180 degrees"
};

/// Views that fit the camera of the other views only when their image is mirrored or turned. A chessboard is
/// its own mirror image: where all images are mirrored alike, they fit a camera, mirrored too, and nothing
/// can be seen. The fewer ones are named. `fitted` is a camera fitted to the views as they are.
std::vector<TurnedImage> findTurnedImages(const CalibrationBoard& board, const std::vector<BoardView>& views,
                                          cv::Size image_size_px, const CameraModel& fitted);

}  // namespace vcharge
