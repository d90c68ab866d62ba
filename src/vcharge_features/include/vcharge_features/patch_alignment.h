#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

struct PatchAlignmentOptions {
  VCHARGE_BEGIN_OPTIONS(PatchAlignmentOptions);
  VCHARGE_OPTION(int, radius_px, 5, between(2, 50), "Half of the side of the square patch.");
  VCHARGE_OPTION(double, shape_sigma, 0.1, above(0.0).upTo(10.0),
                 "Expected standard deviation of each entry of the shape from its initial value.");
  VCHARGE_OPTION(double, min_correlation, 0.9, atLeast(0.0).below(1.0),
                 "Smallest correlation between the aligned patches.");
  VCHARGE_END_OPTIONS();
};

/// Position of a patch in another image and deformation of its surroundings: a point at `anchor_px + x` in
/// the first image is at `position_px + shape * x` in the other.
struct PatchWarp {
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();
};

/// A patch that was found in another image.
struct AlignedPatch : PatchWarp {
  /// Standard deviation of the position in each direction: what differs between the aligned patches,
  /// propagated through the least squares. Patches that straddle a near and a far surface differ most.
  double sigma_px = 0.0;
};

/// Whether a patch that is deformed like this still shows the same things: no direction has grown or shrunk
/// by more than a factor of two.
bool isSamePatch(const Eigen::Matrix2d& shape);

/// Aligns the patch around `anchor_px` of `anchor` with `current`, both CV_8UC1: estimates position and shape
/// by Gauss-Newton steps from `start` (inverse compositional, Baker and Matthews, IJCV 2004), independent of
/// brightness and contrast. Estimating the shape avoids the bias that a translation alone has when the scene
/// comes nearer. Empty if `current` is empty, or if the patch leaves an image, has no texture, does not
/// converge, or still differs after the alignment.
std::optional<AlignedPatch> alignPatch(const cv::Mat& anchor, const cv::Mat& current,
                                       const Eigen::Vector2d& anchor_px, const PatchWarp& start,
                                       const PatchAlignmentOptions& options);

}  // namespace vcharge
