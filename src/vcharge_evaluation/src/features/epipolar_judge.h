#pragma once

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// What judgeMatches() found.
struct EpipolarJudgement {
  int right = 0;                  ///< matches that agree with the epipolar geometry
  double median_error_rad = 0.0;  ///< of these, to the epipolar planes
};

/// Counts the correspondences (unit rays, 3 x N each, NaN counts as wrong) whose rays both lie within
/// `max_error_rad` of their epipolar planes for the essential matrix that fits most of them: eight-point
/// samples, each refined on all that agree. No pose enters, so that real and simulated drives are judged
/// alike. The same seed gives the same judgement. std::logic_error for different N.
EpipolarJudgement judgeMatches(const Eigen::Matrix3Xd& first_rays, const Eigen::Matrix3Xd& second_rays,
                               double max_error_rad, unsigned seed, int num_samples = 4000);

/// As judgeMatches() for a known pose of the first camera in the second's frame.
EpipolarJudgement judgeMatches(const Eigen::Matrix3Xd& first_rays, const Eigen::Matrix3Xd& second_rays,
                               double max_error_rad, const RigidTransform& second_from_first);

}  // namespace vcharge
