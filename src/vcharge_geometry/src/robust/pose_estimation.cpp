#include "vcharge_geometry/robust/pose_estimation.h"

#include <array>
#include <cmath>

#include "robust/local_refinement.h"
#include "vcharge_geometry/robust/angular_error.h"
#include "vcharge_geometry/robust/robust_estimation.h"
#include "vcharge_geometry/solvers/generalized_three_point.h"
#include "vcharge_geometry/solvers/upright_two_point.h"

namespace vcharge {
namespace {

struct FreeSolver {
  static constexpr int kSampleSize = 3;
  using Poses = FixedVector<RotationTranslation, 8>;
  static void solve(const std::array<PointMatch, 3>& matches, Poses* poses) {
    solveGeneralizedThreePoint(matches, poses);
  }
};

struct UprightSolver {
  static constexpr int kSampleSize = 2;
  using Poses = FixedVector<RotationTranslation, 2>;
  static void solve(const std::array<PointMatch, 2>& matches, Poses* poses) {
    solveUprightTwoPoint(matches, poses);
  }
};

/// A problem for estimateRobustly().
template <class Solver, class Parameters>
class PoseProblem {
 public:
  static constexpr int kSampleSize = Solver::kSampleSize;
  static constexpr int kDimensions = 2;

  PoseProblem(const std::vector<PointMatch>& matches, double max_error_rad)
      : matches_(matches), max_error_rad_(max_error_rad) {
    for (const PointMatch& match : matches_) {
      qualities_.push_back(match.quality);
      groups_.push_back(match.camera);
    }
  }

  const std::vector<double>& qualities() const { return qualities_; }
  const std::vector<int>& groups() const { return groups_; }

  template <class Visitor>
  void solve(const std::array<int, static_cast<size_t>(kSampleSize)>& sample, const Visitor& visit) const {
    std::array<PointMatch, static_cast<size_t>(kSampleSize)> matches;
    for (size_t i = 0; i < matches.size(); ++i) {
      matches[i] = matches_[static_cast<size_t>(sample[i])];
    }
    typename Solver::Poses poses;
    Solver::solve(matches, &poses);
    for (const RotationTranslation& pose : poses) {
      visit(pose);
    }
  }

  double squaredError(const RotationTranslation& model, int match) const {
    return squaredPointingError(matches_[static_cast<size_t>(match)], model);
  }

  RobustSums sums(const RotationTranslation& model, double truncation_rad) const {
    RobustSums sums(truncation_rad);
    for (const PointMatch& match : matches_) {
      const double weight = sums.addResidual(squaredPointingError(match, model), kDimensions);
      if (weight == 0.0) {
        continue;
      }
      Eigen::Matrix<double, 3, 6> jacobian;
      const Eigen::Vector3d error = pointingError(match, model, &jacobian);
      const Matrix6d product = jacobian.transpose() * jacobian;
      sums.weighted += weight * product;
      sums.unweighted += product;
      sums.gradient += weight * jacobian.transpose() * error;
    }
    return sums;
  }

  RotationTranslation refined(const RotationTranslation& model, double truncation_rad, int max_steps) const {
    return refineLocally<Parameters>(*this, model, truncation_rad, max_steps);
  }

 private:
  std::vector<PointMatch> matches_;
  std::vector<double> qualities_;
  std::vector<int> groups_;
  double max_error_rad_;
};

EstimationStatus statusOfMatches(const std::vector<PointMatch>& matches, int sample_size) {
  if (static_cast<int>(matches.size()) < sample_size) {
    return EstimationStatus::kTooFewMatches;
  }
  for (const PointMatch& match : matches) {
    if (!match.ray.origin_m.allFinite() || !match.point_m.allFinite() || !std::isfinite(match.quality) ||
        !(std::abs(match.ray.direction.squaredNorm() - 1.0) < 2e-6)) {
      return EstimationStatus::kNotFinite;
    }
  }
  return EstimationStatus::kOk;
}

template <class Solver, class Parameters>
PoseEstimate estimatePose(const std::vector<PointMatch>& matches, const RobustOptions& options) {
  options.validate();
  PoseEstimate estimate;
  estimate.status = statusOfMatches(matches, Solver::kSampleSize);
  if (estimate.status != EstimationStatus::kOk) {
    return estimate;
  }
  const PoseProblem<Solver, Parameters> problem(matches, options.max_error_rad);
  RobustResult result = estimateRobustly(problem, options);
  estimate.num_iterations = result.num_iterations;
  if (!result.found) {
    estimate.status = EstimationStatus::kNoConsensus;
    return estimate;
  }
  const RobustSums sums = problem.sums(result.model, options.max_error_rad);
  estimate.map_from_rig = result.model.transform();
  estimate.covariance = estimateCovariance<Parameters>(sums, result.model);
  estimate.inliers = std::move(result.inliers);
  estimate.noise_rad = std::sqrt(sums.squared_sum / std::max(1, sums.num_components - Parameters::kSize));
  return estimate;
}

}  // namespace

PoseEstimate estimateAbsolutePose(const std::vector<PointMatch>& matches, const RobustOptions& options) {
  return estimatePose<FreeSolver, CartesianParameters<6>>(matches, options);
}

PoseEstimate estimateUprightPose(const std::vector<PointMatch>& matches,
                                 const Eigen::Quaterniond& upright_from_rig, const RobustOptions& options) {
  const RigidTransform turn(upright_from_rig, Eigen::Vector3d::Zero());
  std::vector<PointMatch> upright = matches;
  for (PointMatch& match : upright) {
    match.ray = turn * match.ray;
  }
  PoseEstimate estimate = estimatePose<UprightSolver, CartesianParameters<4>>(upright, options);
  if (estimate.status == EstimationStatus::kOk) {
    // The covariance refers to the map frame and does not change.
    estimate.map_from_rig = estimate.map_from_rig * turn;
  }
  return estimate;
}

}  // namespace vcharge
