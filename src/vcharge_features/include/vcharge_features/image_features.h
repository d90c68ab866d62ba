#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// A point feature. Pixel centres have integer coordinates in the full-size image.
struct Keypoint {
  cv::Point2f position_px;
  float size_px = 0.0F;    ///< diameter of the described patch
  float angle_rad = 0.0F;  ///< orientation of the patch, from x towards y, in [0, 2 pi); 0 if upright
  float response = 0.0F;   ///< response of the detector: larger is more distinct; comparable within one type
};

/// Row i of `descriptors` describes keypoint i. Binary descriptors are CV_8UC1 with 32 columns (256 bits),
/// compared by Hamming distance; others are CV_32FC1, compared by Euclidean distance.
struct ImageFeatures {
  std::vector<Keypoint> keypoints;
  cv::Mat descriptors;

  size_t size() const { return keypoints.size(); }
  bool empty() const { return keypoints.empty(); }
};

}  // namespace vcharge
