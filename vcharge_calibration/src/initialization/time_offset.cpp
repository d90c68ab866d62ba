#include "initialization/time_offset.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

/// Least standard deviations of the distance and turn to a keyframe.
constexpr double kDistanceSigma_m = 0.001;
constexpr double kTurnSigma_rad = 0.0003;
/// Keyframes on either side of one, over which a drift is a constant.
constexpr size_t kReach = 10;
/// Keyframes that err alike.
constexpr size_t kBlock = 20;
constexpr double kLossSigmas = 2.0;
/// Step of the numerical derivative with respect to time.
constexpr double kStep_s = 0.01;

/// Forward distance and turn of a motion.
Eigen::Vector2d distanceAndTurn(const RigidTransform& motion) {
  return {motion.translation().x(), yawOfRotation(motion.rotation())};
}

/// The given fraction of a planar motion, along its arc.
RigidTransform partOf(const RigidTransform& motion, double part) {
  const double turn_rad = yawOfRotation(motion.rotation());
  const Eigen::Rotation2Dd back(-0.5 * turn_rad);
  const Eigen::Vector2d chord = back * motion.translation().head<2>();
  const double shrink =
      std::abs(turn_rad) < 1e-6 ? part : std::sin(0.5 * part * turn_rad) / std::sin(0.5 * turn_rad);
  const Eigen::Vector2d position_m = Eigen::Rotation2Dd(0.5 * part * turn_rad) * (shrink * chord);
  return RigidTransform::planar(position_m.x(), position_m.y(), part * turn_rad);
}

/// Values without their mean over the neighbours.
std::vector<Eigen::Vector2d> withoutDrift(const std::vector<Eigen::Vector2d>& values) {
  std::vector<Eigen::Vector2d> rest = values;
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t begin = i - std::min(i, kReach), end = std::min(values.size(), i + kReach + 1);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (size_t k = begin; k < end; ++k) {
      sum += values[k];
    }
    rest[i] -= sum / static_cast<double>(end - begin);
  }
  return rest;
}

/// Standard deviations of distance and turn, from what an offset leaves of the errors.
Eigen::Vector2d noiseOf(const std::vector<Eigen::Vector2d>& errors,
                        const std::vector<Eigen::Vector2d>& changes_per_s, double offset_s) {
  constexpr double kMedianOfNormal = 0.6745;  // of the absolute value of a standard normal variable
  Eigen::Vector2d sigmas(kDistanceSigma_m, kTurnSigma_rad);
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> rest;
    for (size_t i = 0; i < errors.size(); ++i) {
      rest.push_back(std::abs(errors[i][axis] - offset_s * changes_per_s[i][axis]));
    }
    sigmas[axis] = rest.empty() ? sigmas[axis]
                                : std::max(sigmas[axis], quantile(std::move(rest), 0.5) / kMedianOfNormal);
  }
  return sigmas;
}

}  // namespace

OdometrySeries::OdometrySeries(const ReconstructionState& state) {
  for (const FramePose& frame : state.frames) {
    if (time_s_.empty()) {
      first_ = frame.stamp;
    }
    time_s_.push_back(toSeconds(frame.stamp - first_));
    odom_from_vehicle_.push_back(state.data.keyframes[frame.keyframe].odom_from_vehicle *
                                 frame.keyframe_from_vehicle);
  }
}

RigidTransform OdometrySeries::at(Timestamp stamp, double offset_s) const {
  const double time_s = toSeconds(stamp - first_) + offset_s;
  const auto after = std::upper_bound(time_s_.begin(), time_s_.end(), time_s);
  const auto next =
      std::clamp<std::ptrdiff_t>(after - time_s_.begin(), 1, static_cast<std::ptrdiff_t>(time_s_.size()) - 1);
  const auto i = static_cast<size_t>(next);
  const RigidTransform& previous = odom_from_vehicle_[i - 1];
  const double part = (time_s - time_s_[i - 1]) / (time_s_[i] - time_s_[i - 1]);
  return previous * partOf(previous.inverse() * odom_from_vehicle_[i], part);
}

void OdometrySeries::shift(double offset_s, ReconstructionState* state) const {
  if (time_s_.size() < 2) {
    return;
  }
  for (Keyframe& keyframe : state->data.keyframes) {
    keyframe.odom_from_vehicle = at(keyframe.stamp, offset_s);
  }
  for (FramePose& frame : state->frames) {
    frame.keyframe_from_vehicle =
        state->data.keyframes[frame.keyframe].odom_from_vehicle.inverse() * at(frame.stamp, offset_s);
  }
}

TimeOffset estimateTimeOffset(const ReconstructionState& state,
                              const std::vector<std::vector<MotionPair>>& motions_of_camera,
                              const std::vector<Eigen::Vector3d>& up_in_camera) {
  // The odometer's yaw rate at each keyframe, from the frames around it.
  const std::vector<Keyframe>& keyframes = state.data.keyframes;
  const auto odom_from_vehicle = [&](const FramePose& frame) {
    return keyframes[frame.keyframe].odom_from_vehicle * frame.keyframe_from_vehicle;
  };
  std::vector<double> rate_rad_per_s(keyframes.size(), 0.0);
  for (size_t i = 1; i + 1 < state.frames.size(); ++i) {
    const FramePose& frame = state.frames[i];
    if (frame.stamp == keyframes[frame.keyframe].stamp) {
      const RigidTransform motion =
          odom_from_vehicle(state.frames[i - 1]).inverse() * odom_from_vehicle(state.frames[i + 1]);
      rate_rad_per_s[frame.keyframe] =
          yawOfRotation(motion.rotation()) / toSeconds(state.frames[i + 1].stamp - state.frames[i - 1].stamp);
    }
  }
  // Turns of delayed odometry differ from the camera's by the offset times the change of the yaw rate.
  TimeOffset result;
  constexpr int kIterations = 10;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double information = 0.0, right_side = 0.0;
    for (size_t camera = 0; camera < motions_of_camera.size(); ++camera) {
      for (const MotionPair& motion : motions_of_camera[camera]) {
        const double change = rate_rad_per_s[motion.keyframe + 1] - rate_rad_per_s[motion.keyframe];
        const double error_rad = vectorFromRotation(motion.camera_rotation).dot(up_in_camera[camera]) -
                                 yawOfRotation(motion.vehicle.rotation());
        const double sigma_rad = std::hypot(motion.rotation_sigma_rad, 0.001);
        const double sigmas = (error_rad - result.offset_s * change) / sigma_rad;
        const double weight = 1.0 / (1.0 + sigmas * sigmas / 4.0) / (sigma_rad * sigma_rad);
        information += weight * change * change;
        right_side += weight * change * error_rad;
      }
    }
    if (!(information > 0.0)) {
      return result;
    }
    result.offset_s = right_side / information;
    result.sigma_s = 1.0 / std::sqrt(information);
  }
  return result;
}

TimeOffset refineTimeOffset(const OdometrySeries& series, double offset_s, const ReconstructionData& data) {
  // Distances and turns since the first keyframe: counted ones err by steps of the wheels, which do not add
  // up, and seen ones drift slowly.
  const std::vector<Keyframe>& keyframes = data.keyframes;
  const Eigen::Vector2d scales(data.odometry_distance_scale, data.odometry_turn_scale);
  std::vector<Eigen::Vector2d> errors(keyframes.size(), Eigen::Vector2d::Zero());
  std::vector<Eigen::Vector2d> changes_per_s = errors;
  for (size_t i = 1; i < keyframes.size(); ++i) {
    const auto counted = [&](double shift_s) -> Eigen::Vector2d {
      return scales.cwiseProduct(
          distanceAndTurn(series.at(keyframes[i - 1].stamp, offset_s + shift_s).inverse() *
                          series.at(keyframes[i].stamp, offset_s + shift_s)));
    };
    const Eigen::Vector2d seen =
        distanceAndTurn(keyframes[i - 1].map_from_vehicle.inverse() * keyframes[i].map_from_vehicle);
    errors[i] = errors[i - 1] + seen - counted(0.0);
    changes_per_s[i] = changes_per_s[i - 1] + (counted(kStep_s) - counted(-kStep_s)) / (2.0 * kStep_s);
  }
  errors = withoutDrift(errors);
  changes_per_s = withoutDrift(changes_per_s);
  TimeOffset result;
  constexpr int kIterations = 10;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Eigen::Vector2d sigmas = noiseOf(errors, changes_per_s, result.offset_s);
    Eigen::Vector2d informations = Eigen::Vector2d::Zero(), right_sides = informations;  // of each axis
    std::vector<double> gradients(keyframes.size() / kBlock + 1, 0.0);  // of parts of the drive
    for (size_t i = 0; i < keyframes.size(); ++i) {
      const Eigen::Vector2d change = changes_per_s[i].cwiseQuotient(sigmas);
      const Eigen::Vector2d error = errors[i].cwiseQuotient(sigmas);
      for (int axis = 0; axis < 2; ++axis) {
        const double rest = error[axis] - result.offset_s * change[axis];
        const double weight = 1.0 / (1.0 + rest * rest / (kLossSigmas * kLossSigmas));
        informations[axis] += weight * change[axis] * change[axis];
        right_sides[axis] += weight * change[axis] * error[axis];
        gradients[i / kBlock] += weight * change[axis] * rest;
      }
    }
    const double information = informations.sum();
    if (!(information > 0.0)) {
      return result;
    }
    result.offset_s = right_sides.sum() / information;
    // Neighbouring keyframes err alike: parts of the drive tell how far they contradict each other, and so do
    // distances and turns, which an odometer may filter in different ways.
    const double squares = std::inner_product(gradients.begin(), gradients.end(), gradients.begin(), 0.0);
    double variance_s2 = std::max(1.0, squares / information) / information;
    for (int axis = 0; axis < 2; ++axis) {
      if (informations[axis] > 0.0) {
        const double difference_s = right_sides[axis] / informations[axis] - result.offset_s;
        variance_s2 += informations[axis] / information * difference_s * difference_s;
      }
    }
    result.sigma_s = std::sqrt(variance_s2);
  }
  return result;
}

}  // namespace vcharge
