#include "initialization/camera_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "vcharge_geometry/robust/motion_estimation.h"

namespace vcharge {
namespace {

/// Minimum standard deviations of a motion, because covariances underestimate them.
constexpr double kMinDirectionSigma_rad = 0.003;
constexpr double kMinRotationSigma_rad = 0.0003;
/// Directions with a larger standard deviation are not used.
constexpr double kMaxDirectionSigma_rad = 0.3;

RobustOptions robustOptions() {
  RobustOptions options;
  options.max_error_rad = 0.003;
  options.max_iterations = 300;
  options.min_inliers = 20;
  return options;
}

/// Matches between each keyframe and the next.
std::vector<std::vector<RayMatch>> collectMatches(const ReconstructionData& data, int32_t camera) {
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

std::vector<MotionPair> estimateCameraMotions(const ReconstructionData& data, int32_t camera) {
  const RobustOptions options = robustOptions();
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
    // The covariance refers to the unnormalized translation.
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

}  // namespace vcharge
