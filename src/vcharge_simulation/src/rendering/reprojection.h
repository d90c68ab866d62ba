#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_simulation/rendering/renderer.h"

namespace vcharge {

/// A noise-free image without vignette, with its exact range and the assumed camera model and pose. Tests
/// disturb the model and pose.
struct Picture {
  cv::Mat gray;                         ///< CV_8UC1
  cv::Mat range_m;                      ///< CV_32FC1, see Renderer::renderRange
  std::vector<Eigen::Vector3f> points;  ///< row-major, in the camera frame; NaN where there is no range
  CameraModel camera;
  RigidTransform world_from_camera;
};
/// `view` needs a lens without veil, since the light scattered over the whole image differs between cameras.
Picture takePicture(const Renderer& renderer, const CameraView& view,
                    const RigidTransform& world_from_vehicle, double time_s);

/// Agreement of `first`, warped by its exact range, with `second`.
///
/// Compared are pixels of `first` that both views see at less than 75 degrees from the surface normal and
/// less than 85 degrees from the optical axis, where `second` is not coarser than `first`, and whose
/// neighbours lie on one surface: in `second` they are within a quarter of a pixel of the position predicted
/// by the slope of the surface. Elsewhere, at outlines and in leaves finer than a pixel, one pixel shows
/// several depths.
///
/// Patterns as fine as the pixels are sampled differently by the two views and smoothed by interpolation in
/// `second`, so means over 3x3 pixels are compared with the mean of `second` over the same surface.
struct Reprojection {
  double mean_difference = 0.0;  ///< mean absolute difference of 3x3 means, gray levels
  /// Mean absolute difference of single pixels, which is dominated by fine patterns.
  double mean_pixel_difference = 0.0;
  /// Shift of `second`, in pixels of `first`, for the best agreement (least squares over the gradients);
  /// ideally zero. It detects geometric errors that change gray levels only slightly.
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  int count = 0;  ///< number of 3x3 means
};
std::string toString(const Reprojection& result);
/// kNoCars excludes cars: paint and glass reflect different surroundings into each camera (4 to 12 gray
/// levels).
enum class Surfaces { kAll, kNoCars };
Reprojection reproject(const Renderer& renderer, const Picture& first, const Picture& second,
                       Surfaces surfaces = Surfaces::kAll);

}  // namespace vcharge
