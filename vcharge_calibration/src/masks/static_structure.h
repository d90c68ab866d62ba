#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge::internal {

/// Image size at which bodies are searched, and the field of view in it.
struct SmallView {
  cv::Size size;
  cv::Mat valid;       ///< CV_8UC1, 255 inside the field of view
  cv::Point2f centre;  ///< pixel of the optical axis
  cv::Mat rays;        ///< CV_32FC3, unit vectors in the camera frame; 0 where the model has none
  cv::Mat angle_rad;   ///< CV_32FC1, angle to the optical axis

  /// Number of the sector around the optical axis, out of `num_sectors`, in which a pixel lies.
  size_t sectorOf(int y, int x, size_t num_sectors) const;
};
cv::Size smallSize(const RigCamera& camera);
SmallView makeSmallView(const RigCamera& camera);
cv::Mat shrink(const cv::Mat& pixels, cv::Size size);

/// Length of the mean edge direction from which an edge counts as static.
inline constexpr double kStaticEdge = 0.35;

/// What stays and what moves in the images of a drive, per pixel of a SmallView. All matrices are CV_32FC1.
struct StaticStructure {
  cv::Mat mean;            ///< gray levels
  cv::Mat light;           ///< mean without the fading of the lens at its rim
  cv::Mat fading;          ///< of the lens at its rim, 1 inside
  cv::Mat edge_x, edge_y;  ///< mean of the gradients' directions
  cv::Mat edge;            ///< its length: 1 for an edge that is always there
  cv::Mat moving;          ///< standard deviation over time of the local contrast, without the images' noise
  double typical_moving = 0.0;  ///< median of `moving` away from static edges; 0 if nothing moves
};

/// `images`: CV_8UC1 of the view's size, some may be empty; one weight each.
StaticStructure findStaticStructure(const SmallView& view, const std::vector<cv::Mat>& images,
                                    const std::vector<double>& weights);

}  // namespace vcharge::internal
