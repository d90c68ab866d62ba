#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_simulation/rendering/renderer.h"

namespace vcharge {

/// A noise-free image without the vignette, with its exact range, and what is claimed of its camera: a test
/// of the check claims something wrong.
struct Picture {
  cv::Mat gray;                         ///< CV_8UC1
  cv::Mat range_m;                      ///< CV_32FC1, see Renderer::renderRange
  std::vector<Eigen::Vector3f> points;  ///< row-major, in the camera frame; NaN where there is no range
  CameraModel camera;
  RigidTransform world_from_camera;
};
/// The light that a lens scatters over the whole image differs from camera to camera: `view` needs a lens
/// without veil.
Picture takePicture(const Renderer& renderer, const CameraView& view,
                    const RigidTransform& world_from_vehicle, double time_s);

/// How well `first`, moved by its exact range, agrees with `second`.
///
/// Compared are pixels of `first` that both see, at less than 75 degrees from the surface's normal and 85
/// from the optical axis, where `second` is no coarser than `first`, and that belong to one surface: their
/// neighbours lie in `second` where the surface's slope puts them, to a quarter of a pixel. (Elsewhere, at
/// outlines and in leaves finer than a pixel, one pixel shows things at several depths, and each camera
/// others of them.)
///
/// Two cameras put their pixels differently on a pattern as fine as these pixels, and interpolation of
/// `second` levels it: what they have in common is coarser. So the mean over 3x3 such pixels is compared with
/// the mean of `second` over the same surface.
struct Reprojection {
  double mean_difference = 0.0;  ///< of the means over 3x3 pixels, absolute, gray levels
  /// Of single pixels, which fine patterns dominate: for comparison.
  double mean_pixel_difference = 0.0;
  /// By which `second` would have to move, in pixels of `first`, for the best agreement (least squares over
  /// the gradients): zero but for the error of sampling. It finds errors of geometry that change grays
  /// little.
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  int count = 0;  ///< of means
};
std::string toString(const Reprojection& result);
/// Paint and glass mirror other surroundings into each camera, by physics (4 to 12 gray levels); kNoCars
/// leaves cars out.
enum class Surfaces { kAll, kNoCars };
Reprojection reproject(const Renderer& renderer, const Picture& first, const Picture& second,
                       Surfaces surfaces = Surfaces::kAll);

}  // namespace vcharge
