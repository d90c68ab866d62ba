#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_simulation/renderer.h"

namespace vcharge {

/// An image that a test takes.
struct Sighting {
  const CameraView& view;
  RigidTransform world_from_vehicle;
  double time_s = 0.0;
};

/// An image with its true range and what is claimed of its camera. A test of the check itself claims something
/// wrong.
struct Picture {
  cv::Mat gray;     ///< CV_8UC1, noise-free, without the vignette
  cv::Mat range_m;  ///< CV_32FC1
  CameraModel camera;
  RigidTransform world_from_camera;
};
Picture takePicture(const Renderer& renderer, const Sighting& sighting);

/// How well `first`, moved by its exact range, agrees with `second`.
///
/// Compared are pixels of `first` that both see, at less than 75 degrees from the surface's normal and from the
/// optical axis, where `second` is no coarser than `first`, and that belong to one surface: their neighbours lie
/// in `second` where the surface's slope puts them, to a quarter of a pixel. (Elsewhere, at outlines and in
/// leaves finer than a pixel, one pixel shows things at several depths, and each camera others of them.)
///
/// Two cameras put their pixels differently on a pattern as fine as these pixels, and interpolation of `second`
/// levels it: what they have in common is coarser. So the mean over 3x3 such pixels is compared with the mean of
/// `second` over the same surface.
struct Reprojection {
  double mean_difference = 0.0;  ///< of the means over 3x3 pixels, absolute, gray levels
  /// Of single pixels, which fine patterns dominate: for comparison.
  double mean_pixel_difference = 0.0;
  /// By which `second` would have to move, in pixels of `first`, for the best agreement (least squares over the
  /// gradients): zero but for the error of sampling. It finds errors of geometry that change grays little.
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  int count = 0;  ///< of means
};
/// Cars mirror other surroundings into each camera; kNoCars leaves them out.
enum class Surfaces { kAll, kNoCars };
Reprojection reproject(const Renderer& renderer, const Picture& first, const Picture& second,
                       Surfaces surfaces = Surfaces::kAll);

}  // namespace vcharge
