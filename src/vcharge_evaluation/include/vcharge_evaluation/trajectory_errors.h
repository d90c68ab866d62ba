#pragma once

#include <optional>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/error_distribution.h"

namespace vcharge {

/// How the estimate is aligned with the truth before they are compared.
enum class TrajectoryAlignment {
  kNone,       ///< not at all: the error that the vehicle experiences
  kFirstPose,  ///< the first poses coincide, for odometry, whose origin is arbitrary
  kSe3,        ///< least squares over all positions without scale; hides constant offsets
};

/// Error of one pose in the frame of the true vehicle: forward, left, up.
struct PoseError {
  Timestamp stamp;
  Eigen::Vector3d translation_in_vehicle_m;
  double position_m = 0.0;    ///< length of the above
  double rotation_rad = 0.0;  ///< angle between true and estimated orientation
};

struct TrajectoryErrors {
  std::vector<PoseError> poses;
  size_t num_without_truth = 0;  ///< poses outside the truth, or in a gap of it longer than max_gap_s
  double truth_length_m = 0.0;   ///< true distance travelled between the first and last judged pose
  ErrorDistribution position_m;
  ErrorDistribution longitudinal_m;  ///< absolute values
  ErrorDistribution lateral_m;
  ErrorDistribution rotation_rad;
};

/// Errors of relative motion over a travelled distance, in percent of it and in radians. No alignment hides
/// them.
struct DriftErrors {
  double distance_m = 0.0;
  ErrorDistribution translation_percent;
  ErrorDistribution rotation_rad;
};

/// Interpolates the truth to the estimate's stamps. InputError if fewer than two poses (three for kSe3) have
/// truth.
TrajectoryErrors evaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                    TrajectoryAlignment alignment, double max_gap_s = 0.25);
/// Errors over all pairs of poses that are about `distance_m` of travel apart; their count is 0 for a shorter
/// drive.
DriftErrors evaluateDrift(const Trajectory& estimate, const Trajectory& truth, double distance_m,
                          double max_gap_s = 0.25);

/// Relative scale error by least squares of the aligned positions: 0.01 if all distances are 1 % too long.
/// Absent if the truth does not move. InputError if fewer than three poses have truth.
std::optional<double> evaluateScaleError(const Trajectory& estimate, const Trajectory& truth,
                                         double max_gap_s = 0.25);

/// The poses of a trajectory that have truth, and the truth interpolated to their stamps, of equal length.
struct AssociatedTrajectories {
  Trajectory estimate, truth;
};
AssociatedTrajectories associateWithTruth(const Trajectory& estimate, const Trajectory& truth,
                                          double max_gap_s = 0.25);

/// Rigid transform target_from_source with the least squared distances of corresponding points (Umeyama, PAMI
/// 1991, without scale). std::logic_error for fewer than three pairs.
RigidTransform alignPoints(const std::vector<Eigen::Vector3d>& points_in_source,
                           const std::vector<Eigen::Vector3d>& points_in_target);

}  // namespace vcharge
