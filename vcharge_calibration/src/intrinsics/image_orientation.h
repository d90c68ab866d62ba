#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "intrinsics/intrinsic_optimizer.h"

namespace vcharge {

/// A mirrored or turned image.
struct TurnedImage {
  std::string image;
  std::string how;  ///< "mirrored left-right", "mirrored up-down", "turned by 180 degrees"
};

/// Finds views that fit the camera of the other views only after mirroring or turning their image; names the
/// smaller group. A chessboard equals its mirror image: if all images are mirrored, they fit a mirrored
/// camera, and the error is not detected. `fitted` is a camera fitted to the unmodified views.
std::vector<TurnedImage> findTurnedImages(const CalibrationBoard& board, const std::vector<BoardView>& views,
                                          cv::Size image_size_px, const CameraModel& fitted);

}  // namespace vcharge
