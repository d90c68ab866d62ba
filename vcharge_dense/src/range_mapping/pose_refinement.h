#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// Corrects poses of neighbours relative to one reference by tracks of image points: odometry's jitter
/// becomes a range error sideways, and points that are tracked to a fraction of a pixel see it.
///
/// Each relative pose is estimated by itself: robust least squares over the tracks' angles to their epipolar
/// planes and the given pose with its noise (PoseNoiseOptions), which alone holds the length of the baseline.
/// Where the tracks are few, the estimate does not settle or it leaves the pose's noise far behind, the given
/// pose stays.
class PoseRefinement {
 public:
  /// camera: without distortion; reference and valid_mask: CV_8UC1 of its size.
  PoseRefinement(const MeiCamera& camera, const cv::Mat& reference, const cv::Mat& valid_mask,
                 const PoseNoiseOptions& noise);

  struct Result {
    RigidTransform neighbour_from_reference;
    bool is_refined = false;
    int num_tracks = 0;  ///< that came back to where they started
    /// What the tracks leave of the given pose's variances, mean over the axes.
    double rotation_variance_left = 1.0, translation_variance_left = 1.0;
  };
  /// `pixels` as the reference.
  Result refine(const cv::Mat& pixels, const RigidTransform& neighbour_from_reference) const;

 private:
  MeiCamera camera_;
  cv::Mat valid_mask_;
  PoseNoiseOptions noise_;
  std::vector<cv::Mat> pyramid_;
  std::vector<cv::Point2f> corners_;
  std::vector<Eigen::Vector3d> rays_;  // of the corners
};

}  // namespace vcharge
