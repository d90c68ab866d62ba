#include "vcharge_reconstruction/adjustment/odometry_noise.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// The errors of a motion that has slipped, over the usual ones, and its deviation over the usual one.
constexpr double kSlipSigmas = 5.0;
constexpr double kSlipFactor = 20.0;
/// Motions before and after one that tell what is usual there.
constexpr size_t kNeighbours = 3;
constexpr size_t kMinMotions = 10;
constexpr double kMinSigma_m = 0.0005;
constexpr double kMinSigma_rad = 0.0002;
constexpr double kMinHeightSigma_m = 0.001;
constexpr double kMinTiltSigma_rad = 0.0005;

/// Seen minus counted motion to a keyframe.
OdometrySigmas errorTo(const ReconstructionData& data, size_t keyframe) {
  const Keyframe& previous = data.keyframes[keyframe - 1];
  const Keyframe& current = data.keyframes[keyframe];
  const RigidTransform counted = previous.odom_from_vehicle.inverse() * current.odom_from_vehicle;
  const RigidTransform seen = previous.map_from_vehicle.inverse() * current.map_from_vehicle;
  OdometrySigmas error;
  error << seen.translation() - data.odometry_distance_scale * counted.translation(),
      vectorFromRotation(seen.rotation()).head<2>(),
      yawOfRotation(seen.rotation()) - data.odometry_turn_scale * yawOfRotation(counted.rotation());
  return error;
}

/// Robust deviations of the errors from `begin` to before `end`.
OdometrySigmas sigmasOf(const std::vector<OdometrySigmas>& errors, size_t begin, size_t end) {
  constexpr double kMedianOfNormal = 0.6745;  // of the absolute value of a standard normal variable
  OdometrySigmas sigmas;
  for (Eigen::Index axis = 0; axis < sigmas.size(); ++axis) {
    std::vector<double> values;
    for (size_t i = begin; i < end; ++i) {
      values.push_back(std::abs(errors[i][axis]));
    }
    sigmas[axis] = quantile(std::move(values), 0.5) / kMedianOfNormal;
  }
  return sigmas;
}

/// Whether an error stands out among those around it: in the dark, all motions are seen badly.
bool hasSlipped(const std::vector<OdometrySigmas>& errors, size_t motion, const OdometrySigmas& sigmas) {
  const size_t begin = motion - std::min(motion, kNeighbours);
  const size_t end = std::min(errors.size(), motion + kNeighbours + 1);
  const OdometrySigmas relative =
      errors[motion].cwiseAbs().cwiseQuotient(sigmas.cwiseMax(sigmasOf(errors, begin, end)));
  return std::max({relative[0], relative[1], relative[5]}) > kSlipSigmas;
}

}  // namespace

OdometryNoise estimateOdometryNoise(const ReconstructionData& data, const OdometrySigmas& most) {
  OdometrySigmas least;
  least << kMinSigma_m, kMinSigma_m, kMinHeightSigma_m, kMinTiltSigma_rad, kMinTiltSigma_rad, kMinSigma_rad;
  OdometryNoise noise(data.keyframes.size());
  for (size_t first = 0, end = 0; first < data.keyframes.size(); first = end) {
    std::vector<OdometrySigmas> errors;
    for (end = first + 1;
         end < data.keyframes.size() && data.keyframes[end].session == data.keyframes[first].session; ++end) {
      errors.push_back(errorTo(data, end));
    }
    if (errors.size() < kMinMotions) {
      continue;
    }
    const OdometrySigmas sigmas = sigmasOf(errors, 0, errors.size()).cwiseMin(most).cwiseMax(least);
    for (size_t i = 0; i < errors.size(); ++i) {
      noise[first + 1 + i] = sigmas * (hasSlipped(errors, i, sigmas) ? kSlipFactor : 1.0);
    }
  }
  return noise;
}

}  // namespace vcharge
