#include "vcharge_evaluation/map_errors.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979;
// Errors up to which a loop edge is correct.
constexpr double kMaxEdgeError_m = 0.3;
constexpr double kMaxEdgeError_rad = 0.05235988;
// Distance within which a position is revisited.
constexpr double kRevisitDistance_m = 3.0;
// Travel after which a position counts as revisited.
constexpr double kMinTravel_m = 10.0;

/// The truth at one of the map's keyframes.
struct TruePose {
  RigidTransform world_from_vehicle;
  double travelled_m = 0.0;
};

/// The truth by keyframe; absent outside the true trajectory.
std::vector<std::optional<TruePose>> truthAtKeyframes(const SparseMap& map, const Trajectory& estimate,
                                                      const Trajectory& truth) {
  const AssociatedTrajectories pairs = associateWithTruth(estimate, truth);
  std::vector<double> travelled_m(truth.size(), 0.0);
  for (size_t i = 1; i < truth.size(); ++i) {
    travelled_m[i] =
        travelled_m[i - 1] +
        (truth[i].world_from_vehicle.translation() - truth[i - 1].world_from_vehicle.translation()).norm();
  }
  std::vector<std::optional<TruePose>> result(map.keyframes().size());
  auto pair = pairs.truth.begin();
  for (size_t k = 0; k < result.size() && pair != pairs.truth.end(); ++k) {
    if (pair->stamp != map.keyframes()[k].stamp) {
      continue;
    }
    const auto after =
        std::lower_bound(truth.begin(), truth.end(), pair->stamp,
                         [](const StampedTransform& entry, Timestamp stamp) { return entry.stamp < stamp; });
    const auto index = static_cast<size_t>(after - truth.begin());
    const double beyond_m =
        (after->world_from_vehicle.translation() - pair->world_from_vehicle.translation()).norm();
    result[k] = {pair->world_from_vehicle, travelled_m[index] - beyond_m};
    ++pair;
  }
  return result;
}

/// Angle between the headings of two poses, in [0, pi].
double headingDifference(const TruePose& first, const TruePose& second) {
  const double difference_rad =
      yawOfRotation(first.world_from_vehicle.rotation().conjugate() * second.world_from_vehicle.rotation());
  return std::min(std::abs(difference_rad), kPi);
}

LoopEdgeJudgement judge(const MapLoopEdge& edge, const std::optional<TruePose>& first,
                        const std::optional<TruePose>& second, const MapErrorOptions& options) {
  LoopEdgeJudgement judgement;
  if (!first || !second) {
    return judgement;
  }
  const RigidTransform true_first_from_second =
      first->world_from_vehicle.inverse() * second->world_from_vehicle;
  const RigidTransform error = true_first_from_second.inverse() * edge.first_from_second;
  judgement.has_truth = true;
  judgement.is_opposite = headingDifference(*first, *second) > options.opposite_rad;
  judgement.distance_m = true_first_from_second.translation().norm();
  judgement.error_m = error.translation().norm();
  judgement.error_rad = angleOfRotation(error.rotation());
  judgement.is_right = judgement.error_m <= kMaxEdgeError_m && judgement.error_rad <= kMaxEdgeError_rad;
  return judgement;
}

void judgeEdges(const SparseMap& map, const std::vector<std::optional<TruePose>>& truth,
                const MapErrorOptions& options, MapErrors* errors) {
  std::vector<double> accepted_m, accepted_rad;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    const LoopEdgeJudgement judgement =
        judge(edge, truth[static_cast<size_t>(edge.first)], truth[static_cast<size_t>(edge.second)], options);
    errors->edges.push_back(judgement);
    if (!edge.accepted) {
      RejectedEdges& rejected = errors->rejected[edge.reason.empty() ? "no reason kept" : edge.reason];
      ++rejected.num_edges;
      rejected.num_right += judgement.is_right ? 1 : 0;
    } else if (judgement.has_truth) {
      ++errors->num_accepted;
      errors->num_wrong += judgement.is_right ? 0 : 1;
      accepted_m.push_back(judgement.error_m);
      accepted_rad.push_back(judgement.error_rad);
    }
  }
  errors->accepted_m = summarize(std::move(accepted_m));
  errors->accepted_rad = summarize(std::move(accepted_rad));
}

void countRevisits(const SparseMap& map, const std::vector<std::optional<TruePose>>& truth,
                   const MapErrorOptions& options, MapErrors* errors) {
  const size_t num_keyframes = truth.size();
  std::vector<bool> found_same(num_keyframes, false), found_opposite(num_keyframes, false);
  for (size_t i = 0; i < errors->edges.size(); ++i) {
    const MapLoopEdge& edge = map.contents().loop_edges[i];
    if (edge.accepted && errors->edges[i].is_right) {
      const auto later = static_cast<size_t>(std::max(edge.first, edge.second));
      (errors->edges[i].is_opposite ? found_opposite : found_same)[later] = true;
    }
  }
  const auto count = [](bool found, RevisitCount* revisits) {
    ++revisits->num_keyframes;
    revisits->num_found += found ? 1 : 0;
  };
  errors->is_revisit.assign(num_keyframes, false);
  errors->is_found.assign(num_keyframes, false);
  for (size_t k = 0; k < num_keyframes; ++k) {
    bool same = false, opposite = false;
    for (size_t earlier = 0; truth[k] && earlier < k; ++earlier) {
      if (truth[earlier] && truth[k]->travelled_m - truth[earlier]->travelled_m > kMinTravel_m &&
          (truth[k]->world_from_vehicle.translation() - truth[earlier]->world_from_vehicle.translation())
                  .norm() < kRevisitDistance_m) {
        (headingDifference(*truth[earlier], *truth[k]) > options.opposite_rad ? opposite : same) = true;
      }
    }
    const bool found = found_same[k] || found_opposite[k];
    errors->is_revisit[k] = same || opposite;
    errors->is_found[k] = errors->is_revisit[k] && found;
    if (same || opposite) {
      count(found, &errors->revisits);
    }
    if (same) {
      count(found_same[k], &errors->same);
    }
    if (opposite) {
      count(found_opposite[k], &errors->opposite);
    }
    if (opposite && !same) {
      count(found, &errors->only_opposite);
    }
  }
}

}  // namespace

MapErrors evaluateMap(const SparseMap& map, const Trajectory& truth, const MapErrorOptions& options) {
  options.validate();
  Trajectory estimate;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    estimate.push_back({keyframe.stamp, keyframe.map_from_vehicle});
  }
  MapErrors errors;
  errors.keyframes = evaluateTrajectory(estimate, truth, TrajectoryAlignment::kSe3);
  errors.num_keyframes_without_truth = static_cast<int>(errors.keyframes.num_without_truth);
  errors.scale_error = evaluateScaleError(estimate, truth).value_or(0.0);
  const AssociatedTrajectories pairs = associateWithTruth(estimate, truth);
  std::vector<Eigen::Vector3d> in_map, in_truth;
  for (size_t i = 0; i < pairs.estimate.size(); ++i) {
    in_map.push_back(pairs.estimate[i].world_from_vehicle.translation());
    in_truth.push_back(pairs.truth[i].world_from_vehicle.translation());
  }
  errors.truth_from_map = alignPoints(in_map, in_truth);
  const std::vector<std::optional<TruePose>> true_poses = truthAtKeyframes(map, estimate, truth);
  judgeEdges(map, true_poses, options, &errors);
  countRevisits(map, true_poses, options, &errors);
  return errors;
}

}  // namespace vcharge
