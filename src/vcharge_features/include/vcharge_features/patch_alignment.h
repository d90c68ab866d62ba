#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

struct PatchAlignmentOptions {
  int radius_px = 5;  ///< the patch is a square of twice this and one pixel
  int max_iterations = 20;
  double min_step_px = 0.005;  ///< smaller steps end the iterations
  /// How far each entry of the shape may well be from where it started (standard deviation): holds it where
  /// the patch shows nothing of it.
  double shape_sigma = 0.1;
  double noise_gray_levels = 4.0;  ///< standard deviation of a pixel's difference
  double min_correlation = 0.9;    ///< between the patches in the end
  double max_scale = 2.0;          ///< by which the patch may have grown or shrunk, along any direction

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("radius_px", radius_px);
    visit("max_iterations", max_iterations);
    visit("min_step_px", min_step_px);
    visit("shape_sigma", shape_sigma);
    visit("noise_gray_levels", noise_gray_levels);
    visit("min_correlation", min_correlation);
    visit("max_scale", max_scale);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Where a patch is in another image, and how its surroundings are deformed there: what is at `anchor_px + x`
/// in its own image is at `position_px + shape * x` in the other.
struct PatchPlace {
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();
};

/// Aligns the patch around `anchor_px` of `anchor` with `current`, both CV_8UC1 (or an empty `current`:
/// nothing is found): position and shape by Gauss-Newton steps from `start` (inverse compositional, Baker and
/// Matthews, IJCV 2004), whatever the brightness and contrast of the two are. A patch that is moved alone is
/// pulled aside where the scene comes nearer; with its shape it is not. Nothing where it leaves an image, has
/// no texture, does not converge, or looks different in the end.
std::optional<PatchPlace> alignPatch(const cv::Mat& anchor, const cv::Mat& current,
                                     const Eigen::Vector2d& anchor_px, const PatchPlace& start,
                                     const PatchAlignmentOptions& options);

}  // namespace vcharge
