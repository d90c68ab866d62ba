#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

/// Two cameras, each at a keyframe, and the landmarks that both see there.
struct CameraPairView {
  size_t first_camera = 0, second_camera = 0;
  int32_t first_keyframe = 0, second_keyframe = 0;
  std::vector<int32_t> tracks;  ///< that both rectified views show
};

/// For every two cameras that share landmarks: the keyframes with images at which their views, rectified to
/// the average rotation of the two, show most of them. The pairs of cameras that share most come first.
std::vector<CameraPairView> findCameraPairViews(const MappingData& data, const KeyframeImages& images);

/// Where both rectified views show a landmark: in the same place where it is far away.
struct ViewMatch {
  cv::Point2d first_px, second_px;
};
/// Of each of the pair's tracks.
std::vector<ViewMatch> matchesInViews(const MappingData& data, const CameraPairView& pair);

/// Both views side by side, pinhole views in the average rotation of the two cameras, with lines between the
/// observations of the same landmarks (evenly picked, where there are many). CV_8UC3.
cv::Mat drawCameraPairView(const MappingData& data, const KeyframeImages& images, const CameraPairView& pair);

}  // namespace vcharge
