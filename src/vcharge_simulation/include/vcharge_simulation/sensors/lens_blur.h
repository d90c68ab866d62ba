#pragma once

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Blurs an image by a Gaussian whose width varies per pixel, by repeated diffusion steps along rows and
/// columns. Immutable, thread safe; same bytes for any number of threads.
class LensBlur {
 public:
  LensBlur() = default;
  /// `sigma_px` (CV_32FC1) is the standard deviation at each pixel, at most kMaxSigma_px.
  explicit LensBlur(const cv::Mat& sigma_px);

  static constexpr double kMaxSigma_px = 1.4;

  /// Blurs in place; `light` is CV_32FC1 of the same size. The border is replicated.
  void apply(cv::Mat* light) const;

 private:
  int num_steps_ = 0;
  cv::Mat spread_;  // fraction of the difference to each neighbour that flows in per step
};

/// Point spread of a fisheye lens: nearly Gaussian and wider towards the rim. With the defaults the simulated
/// lot has the same fall-off of the spectrum as the V-Charge images, at every angle from the axis.
struct LensOptions {
  VCHARGE_BEGIN_OPTIONS(LensOptions);
  VCHARGE_OPTION(double, blur_axis_px, 0.35, between(0.0, LensBlur::kMaxSigma_px),
                 "Standard deviation of the blur on the optical axis, in pixels of a 1280x800 image.");
  VCHARGE_OPTION(double, blur_rim_px, 0.80, between(0.0, LensBlur::kMaxSigma_px),
                 "Standard deviation 90 degrees away from the axis; at least blur_axis_px.");
  VCHARGE_OPTION(double, veil, 0.08, notNegative().below(1.0),
                 "Fraction of the mean light that the lens scatters evenly over the image.");
  VCHARGE_END_OPTIONS();

  void checkFields() const;
  /// Standard deviation at an angle from the axis, for an image `image_scale` times as large as 1280x800. It
  /// grows with the angle to the power 1.5.
  double blurAt(double angle_rad, double image_scale) const;
};

}  // namespace vcharge
