#pragma once

#include <optional>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/error_distribution.h"

namespace vcharge {

/// How the estimate is laid over the truth before it is judged.
enum class TrajectoryAlignment {
  kNone,       ///< as it is: what a vehicle that drives by it experiences (causal)
  kFirstPose,  ///< the first poses coincide: for odometry, whose origin is free
  kSe3,        ///< least squares over all positions, no scale: hides any constant offset
};

/// Error of one pose, in the frame of the true vehicle: forward, left, up.
struct PoseError {
  Timestamp stamp;
  Eigen::Vector3d translation_in_vehicle_m;
  double position_m = 0.0;    ///< length of the above
  double rotation_rad = 0.0;  ///< angle between true and estimated orientation
};

struct TrajectoryErrors {
  std::vector<PoseError> poses;
  size_t num_without_truth = 0;  ///< estimates outside the truth, or in a gap of it longer than max_gap_s
  double truth_length_m = 0.0;   ///< travelled between the first and the last judged pose
  ErrorDistribution position_m;
  ErrorDistribution longitudinal_m;  ///< absolute values
  ErrorDistribution lateral_m;
  ErrorDistribution rotation_rad;
};

/// Errors of relative motion over a travelled distance, in percent of that distance and in radians: drift,
/// which no alignment hides.
struct DriftErrors {
  double distance_m = 0.0;
  ErrorDistribution translation_percent;
  ErrorDistribution rotation_rad;
};

/// Truth is interpolated to the estimate's stamps. InputError when fewer than two (kSe3: three) poses have
/// truth.
TrajectoryErrors evaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                    TrajectoryAlignment alignment, double max_gap_s = 0.25);
/// Over all pairs of judged poses that are about `distance_m` of travel apart; count 0 where the drive is
/// shorter.
DriftErrors evaluateDrift(const Trajectory& estimate, const Trajectory& truth, double distance_m,
                          double max_gap_s = 0.25);

/// How much larger the estimate is than the truth, by the similarity that lays its positions over the truth
/// (least squares of the aligned positions): 0.01 where all distances are 1 % too long. Absent where the
/// truth does not move. InputError when fewer than three poses have truth.
std::optional<double> evaluateScaleError(const Trajectory& estimate, const Trajectory& truth,
                                         double max_gap_s = 0.25);

/// The poses of a trajectory that have truth, and the truth interpolated to their stamps; of equal length.
struct AssociatedTrajectories {
  Trajectory estimate, truth;
};
AssociatedTrajectories associateWithTruth(const Trajectory& estimate, const Trajectory& truth,
                                          double max_gap_s = 0.25);

/// Rigid transform target_from_source that minimizes the squared distances of corresponding points (Horn,
/// Umeyama; no scale). std::logic_error unless there are at least three pairs.
RigidTransform alignPoints(const std::vector<Eigen::Vector3d>& points_in_source,
                           const std::vector<Eigen::Vector3d>& points_in_target);

}  // namespace vcharge
