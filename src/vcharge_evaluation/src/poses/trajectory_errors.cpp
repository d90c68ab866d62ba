#include "vcharge_evaluation/trajectory_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/SVD>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {
namespace {

struct Pair {
  Timestamp stamp;
  RigidTransform estimate;
  RigidTransform truth;
};

std::vector<Pair> associate(const Trajectory& estimate, const Trajectory& truth, double max_gap_s) {
  OdometryBufferOptions options;
  options.max_gap_s = max_gap_s;
  options.history_s = std::numeric_limits<double>::infinity();
  OdometryBuffer buffer(options);
  for (const StampedTransform& entry : truth) {
    buffer.add({entry.stamp, entry.world_from_vehicle});
  }
  std::vector<Pair> pairs;
  for (const StampedTransform& entry : estimate) {
    if (const auto lookup = buffer.lookup(entry.stamp)) {
      pairs.push_back({entry.stamp, entry.world_from_vehicle, lookup.odometry.odom_from_vehicle});
    }
  }
  return pairs;
}

/// Travelled distance of the truth at each pair.
std::vector<double> travelledDistance(const std::vector<Pair>& pairs) {
  std::vector<double> distance(pairs.size(), 0.0);
  for (size_t i = 1; i < pairs.size(); ++i) {
    distance[i] = distance[i - 1] + (pairs[i].truth.translation() - pairs[i - 1].truth.translation()).norm();
  }
  return distance;
}

RigidTransform truthFromEstimate(const std::vector<Pair>& pairs, TrajectoryAlignment alignment) {
  if (alignment == TrajectoryAlignment::kNone) {
    return RigidTransform();
  }
  if (alignment == TrajectoryAlignment::kFirstPose) {
    return pairs.front().truth * pairs.front().estimate.inverse();
  }
  std::vector<Eigen::Vector3d> source, target;
  for (const Pair& pair : pairs) {
    source.push_back(pair.estimate.translation());
    target.push_back(pair.truth.translation());
  }
  return alignPoints(source, target);
}

/// InputError when fewer than `needed` poses of the estimate have truth.
void requirePairs(const std::vector<Pair>& pairs, const Trajectory& estimate, size_t needed) {
  if (pairs.size() < needed) {
    throw InputError("trajectory: " + std::to_string(pairs.size()) + " of " +
                     std::to_string(estimate.size()) + " poses have truth at their time, at least " +
                     std::to_string(needed) + " are needed");
  }
}

}  // namespace

RigidTransform alignPoints(const std::vector<Eigen::Vector3d>& points_in_source,
                           const std::vector<Eigen::Vector3d>& points_in_target) {
  check(points_in_source.size() == points_in_target.size() && points_in_source.size() >= 3,
        "alignPoints: expected at least three pairs of points");
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(points_in_source.size());
  for (size_t i = 0; i < points_in_source.size(); ++i) {
    source_mean += points_in_source[i] / count;
    target_mean += points_in_target[i] / count;
  }
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < points_in_source.size(); ++i) {
    correlation += (points_in_target[i] - target_mean) * (points_in_source[i] - source_mean).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d rotation =
      svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  return RigidTransform(Eigen::Quaterniond(rotation), target_mean - rotation * source_mean);
}

TrajectoryErrors evaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                    TrajectoryAlignment alignment, double max_gap_s) {
  const std::vector<Pair> pairs = associate(estimate, truth, max_gap_s);
  requirePairs(pairs, estimate, alignment == TrajectoryAlignment::kSe3 ? 3 : 2);
  TrajectoryErrors errors;
  errors.num_without_truth = estimate.size() - pairs.size();
  errors.truth_length_m = travelledDistance(pairs).back();
  const RigidTransform truth_from_estimate = truthFromEstimate(pairs, alignment);
  std::vector<double> position, longitudinal, lateral, rotation;
  for (const Pair& pair : pairs) {
    const RigidTransform true_vehicle_from_estimated =
        pair.truth.inverse() * (truth_from_estimate * pair.estimate);
    PoseError error;
    error.stamp = pair.stamp;
    error.translation_in_vehicle_m = true_vehicle_from_estimated.translation();
    error.position_m = error.translation_in_vehicle_m.norm();
    error.rotation_rad = angleOfRotation(true_vehicle_from_estimated.rotation());
    errors.poses.push_back(error);
    position.push_back(error.position_m);
    longitudinal.push_back(std::abs(error.translation_in_vehicle_m.x()));
    lateral.push_back(std::abs(error.translation_in_vehicle_m.y()));
    rotation.push_back(error.rotation_rad);
  }
  errors.position_m = summarize(std::move(position));
  errors.longitudinal_m = summarize(std::move(longitudinal));
  errors.lateral_m = summarize(std::move(lateral));
  errors.rotation_rad = summarize(std::move(rotation));
  return errors;
}

DriftErrors evaluateDrift(const Trajectory& estimate, const Trajectory& truth, double distance_m,
                          double max_gap_s) {
  const std::vector<Pair> pairs = associate(estimate, truth, max_gap_s);
  const std::vector<double> travelled = travelledDistance(pairs);
  DriftErrors drift;
  drift.distance_m = distance_m;
  std::vector<double> translation, rotation;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const auto end = std::lower_bound(travelled.begin() + static_cast<std::ptrdiff_t>(i), travelled.end(),
                                      travelled[i] + distance_m);
    if (end == travelled.end()) {
      break;
    }
    const Pair& first = pairs[i];
    const Pair& last = pairs[static_cast<size_t>(end - travelled.begin())];
    const RigidTransform error =
        (first.truth.inverse() * last.truth).inverse() * (first.estimate.inverse() * last.estimate);
    translation.push_back(100.0 * error.translation().norm() / (*end - travelled[i]));
    rotation.push_back(angleOfRotation(error.rotation()));
  }
  drift.translation_percent = summarize(std::move(translation));
  drift.rotation_rad = summarize(std::move(rotation));
  return drift;
}

std::optional<double> evaluateScaleError(const Trajectory& estimate, const Trajectory& truth,
                                         double max_gap_s) {
  const std::vector<Pair> pairs = associate(estimate, truth, max_gap_s);
  requirePairs(pairs, estimate, 3);
  const RigidTransform truth_from_estimate = truthFromEstimate(pairs, TrajectoryAlignment::kSe3);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), true_mean = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) {
    mean += truth_from_estimate * pair.estimate.translation();
    true_mean += pair.truth.translation();
  }
  mean /= static_cast<double>(pairs.size());
  true_mean /= static_cast<double>(pairs.size());
  double correlation_m2 = 0.0, true_m2 = 0.0;
  for (const Pair& pair : pairs) {
    const Eigen::Vector3d true_offset = pair.truth.translation() - true_mean;
    correlation_m2 += true_offset.dot(truth_from_estimate * pair.estimate.translation() - mean);
    true_m2 += true_offset.squaredNorm();
  }
  if (!(true_m2 > 0.0)) {
    return std::nullopt;
  }
  return correlation_m2 / true_m2 - 1.0;
}

AssociatedTrajectories associateWithTruth(const Trajectory& estimate, const Trajectory& truth,
                                          double max_gap_s) {
  AssociatedTrajectories result;
  for (const Pair& pair : associate(estimate, truth, max_gap_s)) {
    result.estimate.push_back({pair.stamp, pair.estimate});
    result.truth.push_back({pair.stamp, pair.truth});
  }
  return result;
}

}  // namespace vcharge
