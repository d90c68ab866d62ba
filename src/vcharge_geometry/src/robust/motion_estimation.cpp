#include "vcharge_geometry/robust/motion_estimation.h"

#include <array>
#include <cmath>

#include "robust/local_refinement.h"
#include "solvers/central_five_point.h"
#include "vcharge_geometry/robust/angular_error.h"
#include "vcharge_geometry/robust/robust_estimation.h"
#include "vcharge_geometry/solvers/ackermann_two_point.h"
#include "vcharge_geometry/solvers/known_vertical_four_point.h"
#include "vcharge_geometry/solvers/planar_three_point.h"

namespace vcharge {
namespace {

/// Standard deviation of a translation's length, relative to it, above which only its direction is reported.
constexpr double kMaxRelativeScaleDeviation = 0.5;

struct AckermannSolver {
  static constexpr int kSampleSize = 2;
  using Motions = FixedVector<YawMotion, 3>;
  static void solve(const std::array<LineMatch, 2>& matches, Motions* motions) {
    solveAckermannTwoPoint(matches, motions);
  }
};

struct PlanarSolver {
  static constexpr int kSampleSize = 3;
  using Motions = FixedVector<YawMotion, 4>;
  static void solve(const std::array<LineMatch, 3>& matches, Motions* motions) {
    solvePlanarThreePoint(matches, motions);
  }
};

struct KnownVerticalSolver {
  static constexpr int kSampleSize = 4;
  using Motions = FixedVector<YawMotion, 6>;
  static void solve(const std::array<LineMatch, 4>& matches, Motions* motions) {
    solveKnownVerticalFourPoint(matches, motions);
  }
};

struct CentralSolver {
  static constexpr int kSampleSize = 5;
  using Motions = CentralMotions;
  static void solve(const std::array<LineMatch, 5>& matches, Motions* motions) {
    solveCentralFivePoint(matches, motions);
  }
};

/// A problem for estimateRobustly().
template <class Solver, class Parameters>
class MotionProblem {
 public:
  static constexpr int kSampleSize = Solver::kSampleSize;
  static constexpr int kDimensions = 1;

  MotionProblem(const std::vector<RayMatch>& matches, double max_error_rad)
      : matches_(matches), max_error_rad_(max_error_rad) {
    constexpr int kMostCameras = 1 << 16;
    for (const RayMatch& match : matches_) {
      lines_.push_back({lineOfRay(match.previous), lineOfRay(match.current)});
      qualities_.push_back(match.quality);
      groups_.push_back(match.previous_camera + kMostCameras * match.current_camera);
    }
  }

  const std::vector<double>& qualities() const { return qualities_; }
  const std::vector<int>& groups() const { return groups_; }

  template <class Visitor>
  void solve(const std::array<int, static_cast<size_t>(kSampleSize)>& sample, const Visitor& visit) const {
    std::array<LineMatch, static_cast<size_t>(kSampleSize)> lines;
    for (size_t i = 0; i < lines.size(); ++i) {
      lines[i] = lines_[static_cast<size_t>(sample[i])];
    }
    typename Solver::Motions motions;
    Solver::solve(lines, &motions);
    for (const auto& motion : motions) {
      visit(RotationTranslation(motion.transform()));
    }
  }

  double squaredError(const RotationTranslation& model, int match) const {
    return squaredEpipolarAngle(matches_[static_cast<size_t>(match)], model, max_error_rad_);
  }

  RobustSums sums(const RotationTranslation& model, double truncation_rad) const {
    RobustSums sums(truncation_rad);
    for (const RayMatch& match : matches_) {
      const EpipolarGeometry geometry(match, model);
      const double weight = sums.addResidual(squaredEpipolarAngle(match, model, max_error_rad_), kDimensions);
      if (weight == 0.0 || !geometry.hasBaseline()) {
        continue;
      }
      Eigen::Matrix<double, 1, 6> jacobian;
      const double error = epipolarAngleWithJacobian(geometry, match.previous.direction, &jacobian);
      const Matrix6d product = jacobian.transpose() * jacobian;
      sums.weighted += weight * product;
      sums.unweighted += product;
      sums.gradient += weight * error * jacobian.transpose();
    }
    return sums;
  }

  RotationTranslation refined(const RotationTranslation& model, double truncation_rad, int max_steps) const {
    return refineLocally<Parameters>(*this, model, truncation_rad, max_steps);
  }

 private:
  std::vector<RayMatch> matches_;
  std::vector<LineMatch> lines_;
  std::vector<double> qualities_;
  std::vector<int> groups_;
  double max_error_rad_;
};

bool isUsable(const Ray& ray) {
  return ray.origin_m.allFinite() && std::abs(ray.direction.squaredNorm() - 1.0) < 2e-6;
}

/// Status of the input: kOk, kTooFewMatches or kNotFinite.
EstimationStatus statusOfMatches(const std::vector<RayMatch>& matches, int sample_size) {
  if (static_cast<int>(matches.size()) < sample_size) {
    return EstimationStatus::kTooFewMatches;
  }
  for (const RayMatch& match : matches) {
    if (!isUsable(match.previous) || !isUsable(match.current) || !std::isfinite(match.quality)) {
      return EstimationStatus::kNotFinite;
    }
  }
  return EstimationStatus::kOk;
}

/// Fills motion, covariance and status from the model and its sums.
template <class Parameters>
void describeModel(const RobustSums& sums, const RotationTranslation& model, MotionEstimate* estimate) {
  Eigen::Vector3d translation = model.translation_m;
  Matrix6d covariance = estimateCovariance<Parameters>(sums, model);
  const double length = translation.norm();
  const Eigen::Vector3d direction =
      length > 0.0 ? Eigen::Vector3d(translation / length) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const double variance_along = direction.dot(covariance.topLeftCorner<3, 3>() * direction);
  estimate->status = EstimationStatus::kOk;
  if (std::sqrt(std::max(0.0, variance_along)) > kMaxRelativeScaleDeviation * std::max(1e-12, length)) {
    estimate->status = EstimationStatus::kScaleUnobservable;
    translation = direction;
    Matrix6d by_direction = Matrix6d::Identity();
    by_direction.topLeftCorner<3, 3>() =
        (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / std::max(1e-12, length);
    covariance = by_direction * covariance * by_direction.transpose();
  }
  estimate->previous_from_current = RigidTransform(Eigen::Quaterniond(model.rotation), translation);
  estimate->covariance = covariance;
  const double degrees_of_freedom = std::max(1, sums.num_components - Parameters::kSize);
  estimate->noise_rad = std::sqrt(sums.squared_sum / degrees_of_freedom);
}

template <class Solver, class Parameters>
MotionEstimate estimateMotion(const std::vector<RayMatch>& matches, const RobustOptions& options) {
  options.validate();
  MotionEstimate estimate;
  estimate.status = statusOfMatches(matches, Solver::kSampleSize);
  if (estimate.status != EstimationStatus::kOk) {
    return estimate;
  }
  const MotionProblem<Solver, Parameters> problem(matches, options.max_error_rad);
  RobustResult result = estimateRobustly(problem, options);
  estimate.num_iterations = result.num_iterations;
  if (!result.found) {
    estimate.status = EstimationStatus::kNoConsensus;
    return estimate;
  }
  estimate.inliers = std::move(result.inliers);
  describeModel<Parameters>(problem.sums(result.model, options.max_error_rad), result.model, &estimate);
  return estimate;
}

}  // namespace

MotionEstimate estimateAckermannMotion(const std::vector<RayMatch>& matches, const RobustOptions& options) {
  return estimateMotion<AckermannSolver, AckermannParameters>(matches, options);
}

MotionEstimate estimatePlanarMotion(const std::vector<RayMatch>& matches, const RobustOptions& options) {
  return estimateMotion<PlanarSolver, CartesianParameters<3>>(matches, options);
}

MotionEstimate estimateKnownVerticalMotion(const std::vector<RayMatch>& matches,
                                           const Eigen::Quaterniond& upright_from_previous,
                                           const Eigen::Quaterniond& upright_from_current,
                                           const RobustOptions& options) {
  const RigidTransform previous_turn(upright_from_previous, Eigen::Vector3d::Zero());
  const RigidTransform current_turn(upright_from_current, Eigen::Vector3d::Zero());
  std::vector<RayMatch> upright = matches;
  for (RayMatch& match : upright) {
    match.previous = previous_turn * match.previous;
    match.current = current_turn * match.current;
  }
  MotionEstimate estimate = estimateMotion<KnownVerticalSolver, CartesianParameters<4>>(upright, options);
  if (!isUsable(estimate)) {
    return estimate;
  }
  estimate.previous_from_current = previous_turn.inverse() * estimate.previous_from_current * current_turn;
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = previous_turn.inverse().rotationMatrix();
  estimate.covariance = turn * estimate.covariance * turn.transpose();
  return estimate;
}

MotionEstimate estimateCentralMotion(const std::vector<RayMatch>& matches, const RobustOptions& options) {
  return estimateMotion<CentralSolver, CartesianParameters<6>>(matches, options);
}

MotionEstimate refineMotion(const std::vector<RayMatch>& matches,
                            const RigidTransform& initial_previous_from_current,
                            const RobustOptions& options) {
  options.validate();
  MotionEstimate estimate;
  estimate.status = statusOfMatches(matches, 6);
  if (estimate.status != EstimationStatus::kOk) {
    return estimate;
  }
  const MotionProblem<KnownVerticalSolver, CartesianParameters<6>> problem(matches, options.max_error_rad);
  constexpr int kMaxSteps = 50;
  const RotationTranslation model =
      problem.refined(RotationTranslation(initial_previous_from_current), options.max_error_rad, kMaxSteps);
  for (int i = 0; i < static_cast<int>(matches.size()); ++i) {
    if (problem.squaredError(model, i) < options.max_error_rad * options.max_error_rad) {
      estimate.inliers.push_back(i);
    }
  }
  if (static_cast<int>(estimate.inliers.size()) < options.min_inliers) {
    estimate.inliers.clear();
    estimate.status = EstimationStatus::kNoConsensus;
    return estimate;
  }
  describeModel<CartesianParameters<6>>(problem.sums(model, options.max_error_rad), model, &estimate);
  return estimate;
}

}  // namespace vcharge
