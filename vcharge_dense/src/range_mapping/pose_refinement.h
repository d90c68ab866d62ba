#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// Corrects the poses of neighbours relative to one reference by tracked image points. Odometry's jitter
/// causes range errors of cameras that look sideways, and tracks with subpixel accuracy reveal it.
///
/// Each relative pose is estimated separately: robust least squares over the tracks' angles to their epipolar
/// planes, with the given pose and its noise (PoseNoiseOptions) as prior; only the prior constrains the
/// length of the baseline. The given pose is kept if there are few tracks, the estimate does not converge,
/// or it differs from the given pose by much more than the noise. Thread safe.
class PoseRefinement {
 public:
  /// `camera` has no distortion; `reference` and `valid_mask`: CV_8UC1 of its size.
  PoseRefinement(const MeiCamera& camera, const cv::Mat& reference, const cv::Mat& valid_mask,
                 const PoseNoiseOptions& noise);

  struct Result {
    RigidTransform neighbour_from_reference;
    bool is_refined = false;
    int num_tracks = 0;  ///< number of tracks whose backward track returns to its start
    /// Remaining fraction of the given pose's variances, mean over the axes.
    double rotation_variance_left = 1.0, translation_variance_left = 1.0;
  };
  /// Refines the pose of a neighbour with these pixels (CV_8UC1, size of the reference).
  Result refine(const cv::Mat& pixels, const RigidTransform& neighbour_from_reference) const;

 private:
  MeiCamera camera_;
  cv::Mat valid_mask_;
  PoseNoiseOptions noise_;
  std::vector<cv::Mat> pyramid_;
  std::vector<cv::Point2f> corners_;
  std::vector<Eigen::Vector3d> rays_;  // unit rays of the corners
};

}  // namespace vcharge
