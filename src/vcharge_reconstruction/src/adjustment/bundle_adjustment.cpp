#include "vcharge_reconstruction/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>
#include <Eigen/LU>

#include "vcharge_core/base/error.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"

namespace vcharge {
namespace {

OdometrySigmas odometrySigmas(const RigidTransform& motion, const BundleAdjustmentOptions& options) {
  const double distance_m = motion.translation().head<2>().norm();
  const double sigma_m = options.odometry_sigma_m + options.odometry_distance_sigma * distance_m;
  const double sigma_rad =
      options.odometry_sigma_rad + options.odometry_turn_sigma * std::abs(yawOfRotation(motion.rotation()));
  OdometrySigmas sigmas;
  sigmas << sigma_m, sigma_m, options.height_sigma_m, options.tilt_sigma_rad, options.tilt_sigma_rad,
      sigma_rad;
  return sigmas;
}

Eigen::Matrix<double, 6, 6> informationOf(const OdometrySigmas& sigmas) {
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// Keeps the present pose between two sessions that no landmark joins: weak, since nothing measured it.
Eigen::Matrix<double, 6, 6> sessionBorderInformation() {
  constexpr double kSigma_m = 10.0;
  constexpr double kSigma_rad = 1.0;
  OdometrySigmas sigmas;
  sigmas << kSigma_m, kSigma_m, kSigma_m, kSigma_rad, kSigma_rad, kSigma_rad;
  return informationOf(sigmas);
}

/// An observation this close to its landmark shows it, even where it errs more than its deviation says.
constexpr double kSamePlace_px = 1.5;

struct TrackCheck {
  int64_t kept = 0, removed = 0;
  double squares = 0.0;
  bool was_landmark = false, is_landmark = false;
};

/// Covariance of a landmark for fixed poses: each ray fixes the position perpendicular to it, with the
/// standard deviation of its angle times the range.
Eigen::Matrix3d conditionalCovariance(const ReconstructionData& data, const Track& track,
                                      double* max_parallax_rad) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> directions;
  double min_cosine = 1.0;
  for (const TrackObservation& observation : track.observations) {
    const RigCamera& camera = data.rig->cameras[observation.camera];
    const RigidTransform map_from_camera =
        cameraAt(data.keyframes[observation.keyframe], *data.rig, observation.camera)
            .poseAt(observation.position_px);
    const Eigen::Vector3d to_point = *track.position_m - map_from_camera.translation();
    const Eigen::Vector3d direction = to_point.normalized();
    Eigen::Vector3d ray, shifted_ray;
    if (!camera.model.unproject(observation.position_px, &ray) ||
        !camera.model.unproject(observation.position_px + Eigen::Vector2d(0.5, 0.5), &shifted_ray)) {
      continue;
    }
    const double rad_per_px = (shifted_ray - ray).norm() / std::sqrt(0.5);
    const double sigma_m = std::max(1e-6, observation.sigma_px * rad_per_px * to_point.norm());
    information += (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / (sigma_m * sigma_m);
    for (const Eigen::Vector3d& other : directions) {
      min_cosine = std::min(min_cosine, other.dot(direction));
    }
    directions.push_back(direction);
  }
  *max_parallax_rad = std::acos(std::max(-1.0, min_cosine));
  const Eigen::Matrix3d covariance = information.inverse();
  return covariance.allFinite() ? covariance : Eigen::Matrix3d::Zero();
}

TrackCheck checkTrack(const BundleAdjustmentOptions& options, const ReconstructionData& data, Track* track) {
  TrackCheck result;
  result.was_landmark = true;
  std::vector<TrackObservation> kept;
  double min_range_m = INFINITY;
  for (TrackObservation observation : track->observations) {
    Eigen::Vector2d error_px = Eigen::Vector2d::Zero();
    const bool is_seen = reprojectionError(data, *track, observation, &error_px);
    const bool is_precise = error_px.norm() <= options.outlier_sigmas * observation.sigma_px;
    if (!is_seen || (!is_precise && error_px.norm() > kSamePlace_px)) {
      ++result.removed;
      continue;
    }
    if (!is_precise) {
      observation.sigma_px = kImpreciseSigma_px;
    }
    result.squares += error_px.squaredNorm();
    min_range_m = std::min(
        min_range_m,
        (data.keyframes[observation.keyframe].map_from_vehicle.translation() - *track->position_m).norm());
    kept.push_back(observation);
  }
  track->observations = std::move(kept);
  double parallax_rad = 0.0;
  if (static_cast<int>(track->observations.size()) >= options.min_observations) {
    track->covariance_m2 = conditionalCovariance(data, *track, &parallax_rad);
  }
  result.is_landmark = parallax_rad >= options.min_parallax_rad && min_range_m <= options.max_range_m;
  if (result.is_landmark) {
    result.kept = static_cast<int64_t>(track->observations.size());
  } else {
    track->position_m.reset();
    result.squares = 0.0;
  }
  return result;
}

}  // namespace

bool reprojectionError(const ReconstructionData& data, const Track& track,
                       const TrackObservation& observation, Eigen::Vector2d* error_px) {
  const RigCamera& camera = data.rig->cameras[observation.camera];
  const RigidTransform map_from_camera =
      cameraAt(data.keyframes[observation.keyframe], *data.rig, observation.camera)
          .poseAt(observation.position_px);
  Eigen::Vector2d pixel;
  if (!camera.model.project(map_from_camera.inverse() * *track.position_m, &pixel)) {
    return false;
  }
  *error_px = pixel - observation.position_px;
  return true;
}

BundleProblem makeBundleProblem(const BundleAdjustmentOptions& options, const ReconstructionData& data,
                                const OdometryNoise& odometry) {
  BundleProblem problem;
  problem.rig = data.rig;
  problem.odometer = {data.odometry_distance_scale, data.odometry_turn_scale};
  problem.odometer_sigmas = {options.odometer_scale_sigma, options.odometer_turn_sigma};
  for (const Keyframe& keyframe : data.keyframes) {
    problem.map_from_vehicle.push_back(keyframe.map_from_vehicle);
    problem.rates.push_back(keyframe.motion.rates);
  }
  for (const Track& track : data.tracks) {
    if (!track.position_m) {
      continue;
    }
    problem.points_in_map.push_back(*track.position_m);
    problem.first_observation.push_back(problem.observations.size());
    for (const TrackObservation& observation : track.observations) {
      problem.observations.push_back(
          {observation.keyframe, observation.camera, observation.position_px, observation.sigma_px,
           data.keyframes[observation.keyframe].motion.offsetOf(observation.camera)});
    }
  }
  problem.first_observation.push_back(problem.observations.size());
  for (size_t i = 1; i < data.keyframes.size(); ++i) {
    const Keyframe& previous = data.keyframes[i - 1];
    const Keyframe& keyframe = data.keyframes[i];
    if (keyframe.session != previous.session) {
      problem.odometer_factors.push_back({static_cast<int32_t>(i),
                                          previous.map_from_vehicle.inverse() * keyframe.map_from_vehicle,
                                          sessionBorderInformation()});
      continue;
    }
    const RigidTransform motion = previous.odom_from_vehicle.inverse() * keyframe.odom_from_vehicle;
    const bool is_known = !odometry.empty() && odometry[i].has_value();
    problem.odometer_factors.push_back(
        {static_cast<int32_t>(i), motion,
         informationOf(is_known ? *odometry[i] : odometrySigmas(motion, options))});
  }
  return problem;
}

void writeBack(const BundleProblem& problem, ReconstructionData* data) {
  for (size_t i = 0; i < data->keyframes.size(); ++i) {
    data->keyframes[i].map_from_vehicle = problem.map_from_vehicle[i];
  }
  auto point = problem.points_in_map.begin();
  for (Track& track : data->tracks) {
    if (track.position_m) {
      track.position_m = *point++;
    }
  }
  data->odometry_distance_scale = problem.odometer[0];
  data->odometry_turn_scale = problem.odometer[1];
}

OdometryNoise estimateOdometryNoise(const BundleAdjustmentOptions& options, const ReconstructionData& data) {
  return estimateOdometryNoise(data, odometrySigmas(RigidTransform(), options));
}

BundleAdjustmentSummary adjustBundle(const BundleAdjustmentOptions& options, ReconstructionData* data,
                                     const OdometryNoise& odometry) {
  options.validate();
  check(!data->keyframes.empty(), "adjustBundle: expected keyframes");
  BundleProblem problem = makeBundleProblem(options, *data, odometry);
  const BundleSolution solved = solveBundle(options.max_iterations, options.cost_tolerance, &problem);
  writeBack(problem, data);
  BundleAdjustmentSummary summary = removeOutliers(options, data);
  summary.converged = solved.converged;
  summary.num_iterations = solved.num_iterations;
  return summary;
}

BundleAdjustmentSummary removeOutliers(const BundleAdjustmentOptions& options, ReconstructionData* data) {
  BundleAdjustmentSummary summary;
  std::vector<TrackCheck> checks(data->tracks.size());
  tbb::parallel_for(size_t{0}, data->tracks.size(), [&](size_t i) {
    if (data->tracks[i].position_m) {
      checks[i] = checkTrack(options, *data, &data->tracks[i]);
    }
  });
  double squares = 0.0;
  for (const TrackCheck& check_of_track : checks) {
    summary.num_observations += check_of_track.kept;
    summary.num_removed_landmarks += check_of_track.was_landmark && !check_of_track.is_landmark ? 1 : 0;
    summary.num_removed_observations += check_of_track.removed;
    squares += check_of_track.squares;
  }
  if (summary.num_observations > 0) {
    summary.rms_px = std::sqrt(squares / (2.0 * static_cast<double>(summary.num_observations)));
  }
  return summary;
}

}  // namespace vcharge
