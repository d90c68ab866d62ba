#pragma once

#include <opencv2/core.hpp>

namespace vcharge {

/// Point spread of a fisheye lens: nearly Gaussian, and wider towards the rim. The defaults give the
/// simulated lot the fall-off of the spectrum that the V-Charge images have, at every angle from the axis.
struct LensOptions {
  double blur_axis_px = 0.35;  ///< standard deviation on the optical axis, in pixels of a 1280x800 image
  double blur_rim_px = 0.80;   ///< 90 degrees away from it; between, it grows with the angle to the power 1.5
  double veil = 0.08;          ///< share of the mean light that the lens scatters evenly over the sensor

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("blur_axis_px", blur_axis_px);
    visit("blur_rim_px", blur_rim_px);
    visit("veil", veil);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
  /// Standard deviation at an angle from the axis, for an image `image_scale` times as large as 1280x800.
  double blurAt(double angle_rad, double image_scale) const;
};

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

}  // namespace vcharge
