#include "camera_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "vcharge_geometry/motion_estimation.h"

namespace vcharge {
namespace {

/// A direction is no better than this, whatever its covariance says.
constexpr double kMinDirectionSigma_rad = 0.003;
constexpr double kMinRotationSigma_rad = 0.0003;
/// A less certain direction is none.
constexpr double kMaxDirectionSigma_rad = 0.3;

/// Matches between keyframe i and the next, by i.
std::vector<std::vector<RayMatch>> collectMatches(const MappingData& data, int32_t camera) {
  std::vector<std::vector<RayMatch>> matches(data.keyframes.size());
  const CameraModel& model = data.rig->cameras[camera].model;
  for (const Track& track : data.tracks) {
    const TrackObservation* previous = nullptr;
    for (const TrackObservation& observation : track.observations) {
      if (observation.camera != camera) {
        continue;
      }
      RayMatch match;
      if (previous != nullptr && previous->keyframe + 1 == observation.keyframe &&
          model.unproject(previous->position_px, &match.previous.direction) &&
          model.unproject(observation.position_px, &match.current.direction)) {
        match.previous.origin_m = match.current.origin_m = Eigen::Vector3d::Zero();
        match.previous_camera = match.current_camera = camera;
        matches[previous->keyframe].push_back(match);
      }
      previous = &observation;
    }
  }
  return matches;
}

}  // namespace

std::vector<MotionPair> estimateCameraMotions(const MappingData& data, int32_t camera,
                                              const RobustOptions& options) {
  const std::vector<std::vector<RayMatch>> matches = collectMatches(data, camera);
  std::vector<std::optional<MotionPair>> found(matches.size());
  tbb::parallel_for(size_t{0}, matches.size(), [&](size_t i) {
    if (i + 1 >= data.keyframes.size()) {
      return;
    }
    const MotionEstimate motion = estimateCentralMotion(matches[i], options);
    if (!isUsable(motion) || 2 * motion.inliers.size() < matches[i].size()) {
      return;
    }
    const Eigen::Vector3d& translation = motion.previous_from_current.translation();
    MotionPair pair;
    pair.keyframe = static_cast<int32_t>(i);
    pair.vehicle = data.keyframes[i].odom_from_vehicle.inverse() * data.keyframes[i + 1].odom_from_vehicle;
    pair.camera_rotation = motion.previous_from_current.rotation();
    pair.camera_direction = translation.normalized();
    // The covariance is that of a vector of the length found.
    const double sigma = std::sqrt(
        (motion.covariance.topLeftCorner<3, 3>().trace() -
         pair.camera_direction.dot(motion.covariance.topLeftCorner<3, 3>() * pair.camera_direction)) /
        2.0);
    pair.direction_sigma_rad = std::hypot(sigma / translation.norm(), kMinDirectionSigma_rad);
    pair.rotation_sigma_rad = std::hypot(std::sqrt(motion.covariance.bottomRightCorner<3, 3>().trace() / 3.0),
                                         kMinRotationSigma_rad);
    pair.has_direction = pair.direction_sigma_rad < kMaxDirectionSigma_rad;
    found[i] = pair;
  });
  std::vector<MotionPair> motions;
  for (const std::optional<MotionPair>& pair : found) {
    if (pair) {
      motions.push_back(*pair);
    }
  }
  return motions;
}

TimeOffset estimateTimeOffset(const MappingState& state,
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
  // Odometry that is late lags behind the camera's turn by offset times the change of the rate.
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

}  // namespace vcharge
