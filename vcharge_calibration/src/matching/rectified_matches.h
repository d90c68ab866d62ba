#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Two cameras, each at a keyframe, and the landmarks that both observe.
struct CameraPairView {
  size_t first_camera = 0, second_camera = 0;
  int32_t first_keyframe = 0, second_keyframe = 0;
  std::vector<int32_t> tracks;  ///< landmarks in both rectified views
};

/// For every two cameras with common landmarks, finds the keyframes with images whose views, rectified to the
/// mean rotation of the two, contain most of them. Returns the pairs with most common landmarks first.
std::vector<CameraPairView> findCameraPairViews(const ReconstructionData& data, const KeyframeImages& images);

/// Positions of a landmark in both rectified views; equal for a distant one.
struct ViewMatch {
  cv::Point2d first_px, second_px;
};
/// Positions of the pair's tracks.
std::vector<ViewMatch> matchesInViews(const ReconstructionData& data, const CameraPairView& pair);

/// Picture of both pinhole views side by side, with lines between the observations of the same landmarks (an
/// even selection of many). CV_8UC3.
cv::Mat drawCameraPairView(const ReconstructionData& data, const KeyframeImages& images,
                           const CameraPairView& pair);

}  // namespace vcharge
