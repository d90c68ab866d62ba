#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_rates.h"
#include "vcharge_dense/exposure.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// Corrects the motion of the vehicle between two of its images. Odometry's jitter, and a body that pitches,
/// rolls and heaves, cause errors of ranges; image points that are followed with subpixel accuracy reveal
/// them.
///
/// All cameras sit on one body, so they share one motion: the points of the side cameras tell the rotation
/// that spoils the ranges of the front camera, whose own points hardly move. The motion is estimated by
/// robust least squares over the angles of the followed points to their epipolar planes, with the given
/// motion and its noise (PoseNoiseOptions) as prior; only the prior constrains the length of the baseline.
/// The given motion is kept if there are few points, the estimate does not converge, or it differs from the
/// given motion by much more than the noise.
class MotionRefinement {
 public:
  /// `model` has no distortion; `valid_mask`: CV_8UC1, not 0 where pixels may be used.
  struct Camera {
    MeiCamera model;
    cv::Mat valid_mask;
    RigidTransform vehicle_from_camera;
    ExposureTimes times = {};
  };

  /// Indexed as in the rig; cameras that are not in use are empty.
  MotionRefinement(const std::vector<std::optional<Camera>>& cameras, const PoseNoiseOptions& noise);
  ~MotionRefinement();

  /// Follows the points of each camera into its next image (CV_8UC1 of its size; empty: none). Stamps must
  /// rise. `odom_from_vehicle` predicts the points; `motion` tells from where a line saw them.
  void addFrame(Timestamp stamp, const std::vector<cv::Mat>& images, const RigidTransform& odom_from_vehicle,
                const FrameMotion& motion = {});
  /// Drops what was observed before this stamp.
  void forgetBefore(Timestamp stamp);
  void clear();

  struct Result {
    RigidTransform neighbour_from_reference;  ///< of the vehicle
    bool is_refined = false;
    int num_points = 0;  ///< points that all cameras saw in both frames
    /// Remaining fraction of the given motion's variances: mean over the axes of the rotation, and of the
    /// translation along the baseline, which parallax is proportional to.
    double rotation_variance_left = 1.0, translation_variance_left = 1.0;
  };
  /// Refines the motion of the vehicle between two added frames.
  Result refine(Timestamp neighbour, Timestamp reference,
                const RigidTransform& neighbour_from_reference) const;
  /// A neighbour of a camera's image, both added, with its pose relative to the reference and the noise of
  /// that pose refined.
  SweepImage refined(const SweepImage& neighbour, const SweepImage& reference,
                     const RigidTransform& vehicle_from_camera) const;

 private:
  class FollowedCamera;

  const PoseNoiseOptions noise_;
  std::vector<std::unique_ptr<FollowedCamera>> cameras_;
};

}  // namespace vcharge
