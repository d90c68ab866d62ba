#include "vcharge_mapping/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <tbb/parallel_for.h>
#include <Eigen/LU>

#include "vcharge_core/error.h"
#include "vcharge_geometry/pose_block.h"
#include "vcharge_geometry/rig_costs.h"
#include "vcharge_mapping/triangulation.h"

namespace vcharge {
namespace {

Eigen::Matrix<double, 6, 6> odometryInformation(const RigidTransform& motion,
                                                const BundleAdjustmentOptions& options) {
  const double distance_m = motion.translation().head<2>().norm();
  const double sigma_m = options.odometry_sigma_m + options.odometry_distance_sigma * distance_m;
  const double sigma_rad =
      options.odometry_sigma_rad + options.odometry_turn_sigma * std::abs(yawOfRotation(motion.rotation()));
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << sigma_m, sigma_m, options.height_sigma_m, options.tilt_sigma_rad, options.tilt_sigma_rad,
      sigma_rad;
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// The parameter blocks of a bundle adjustment.
class Bundle {
 public:
  Bundle(const BundleAdjustmentOptions& options, MappingData* data) : options_(options), data_(data) {
    for (const Keyframe& keyframe : data->keyframes) {
      poses_.push_back(toPoseBlock(keyframe.map_from_vehicle));
    }
    for (const RigCamera& camera : data->rig->cameras) {
      extrinsics_.push_back(toPoseBlock(*camera.vehicle_from_camera));
    }
    odometer_[0] = data->odometry_distance_scale;
    odometer_[1] = data->odometry_turn_scale;
  }

  ceres::Solver::Summary solve() {
    ceres::Problem::Options problem_options;
    problem_options.enable_fast_removal = false;
    ceres::Problem problem(problem_options);
    auto* manifold = makePoseManifold().release();  // the problem's from the first use on
    for (PoseBlock& pose : poses_) {
      problem.AddParameterBlock(pose.data(), 7, manifold);
    }
    for (PoseBlock& extrinsics : extrinsics_) {
      problem.AddParameterBlock(extrinsics.data(), 7, manifold);
      problem.SetParameterBlockConstant(extrinsics.data());
    }
    problem.SetParameterBlockConstant(poses_.front().data());
    auto* ordering = new ceres::ParameterBlockOrdering;
    addObservations(&problem, ordering);
    addOdometry(&problem);
    for (PoseBlock& pose : poses_) {
      ordering->AddElementToGroup(pose.data(), 1);
    }
    for (PoseBlock& extrinsics : extrinsics_) {
      ordering->AddElementToGroup(extrinsics.data(), 1);
    }
    if (problem.HasParameterBlock(odometer_)) {
      ordering->AddElementToGroup(odometer_, 1);
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_SCHUR;
    solver.linear_solver_ordering.reset(ordering);
    solver.max_num_iterations = options_.max_iterations;
    solver.num_threads = options_.deterministic ? 1 : 2;
    solver.function_tolerance = 1e-5;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    return summary;
  }

  void writeBack() {
    for (size_t i = 0; i < poses_.size(); ++i) {
      data_->keyframes[i].map_from_vehicle = fromPoseBlock(poses_[i]);
    }
    data_->odometry_distance_scale = odometer_[0];
    data_->odometry_turn_scale = odometer_[1];
  }

 private:
  void addObservations(ceres::Problem* problem, ceres::ParameterBlockOrdering* ordering) {
    auto* loss = new ceres::CauchyLoss(options_.loss_sigmas);
    std::vector<std::shared_ptr<const CameraModel>> models;
    for (const RigCamera& camera : data_->rig->cameras) {
      models.emplace_back(data_->rig, &camera.model);
    }
    for (Track& track : data_->tracks) {
      if (!track.position_m) {
        continue;
      }
      for (const TrackObservation& observation : track.observations) {
        problem->AddResidualBlock(
            makeReprojectionCost(models[observation.camera], observation.position_px, observation.sigma_px)
                .release(),
            loss, poses_[observation.keyframe].data(), extrinsics_[observation.camera].data(),
            track.position_m->data());
      }
      ordering->AddElementToGroup(track.position_m->data(), 0);
    }
  }

  void addOdometry(ceres::Problem* problem) {
    for (size_t i = 1; i < data_->keyframes.size(); ++i) {
      const Keyframe& previous = data_->keyframes[i - 1];
      const Keyframe& current = data_->keyframes[i];
      const RigidTransform motion = previous.odom_from_vehicle.inverse() * current.odom_from_vehicle;
      problem->AddResidualBlock(makeOdometryCost(motion, odometryInformation(motion, options_)).release(),
                                nullptr, poses_[i - 1].data(), poses_[i].data(), odometer_);
    }
    if (problem->HasParameterBlock(odometer_)) {
      // Where images cannot tell the scale, the odometer's calibration does.
      const Eigen::Vector2d information(1.0 / options_.odometer_scale_sigma,
                                        1.0 / options_.odometer_turn_sigma);
      problem->AddResidualBlock(new ceres::NormalPrior(information.asDiagonal(), Eigen::Vector2d::Ones()),
                                nullptr, odometer_);
    }
  }

  const BundleAdjustmentOptions& options_;
  MappingData* data_;
  std::vector<PoseBlock> poses_, extrinsics_;
  double odometer_[2];
};

struct TrackCheck {
  int64_t kept = 0, removed = 0;
  double squares = 0.0;
  bool was_landmark = false, is_landmark = false;
};

/// Residual of an observation over its standard deviation, and what it tells of the landmark's position.
bool reproject(const MappingData& data, const Track& track, const TrackObservation& observation,
               Eigen::Vector2d* error_px) {
  const RigCamera& camera = data.rig->cameras[observation.camera];
  const RigidTransform map_from_camera =
      data.keyframes[observation.keyframe].map_from_vehicle * *camera.vehicle_from_camera;
  Eigen::Vector2d pixel;
  if (!camera.model.project(map_from_camera.inverse() * *track.position_m, &pixel)) {
    return false;
  }
  *error_px = pixel - observation.position_px;
  return true;
}

/// Of the landmark given the poses: every ray tells the position across it to its angle's deviation times
/// range.
Eigen::Matrix3d conditionalCovariance(const MappingData& data, const Track& track, double* max_parallax_rad) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> directions;
  double min_cosine = 1.0;
  for (const TrackObservation& observation : track.observations) {
    const RigCamera& camera = data.rig->cameras[observation.camera];
    const RigidTransform map_from_camera =
        data.keyframes[observation.keyframe].map_from_vehicle * *camera.vehicle_from_camera;
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

TrackCheck checkTrack(const BundleAdjustmentOptions& options, const MappingData& data, Track* track) {
  TrackCheck result;
  result.was_landmark = true;
  std::vector<TrackObservation> kept;
  double min_range_m = INFINITY;
  for (const TrackObservation& observation : track->observations) {
    Eigen::Vector2d error_px;
    if (!reproject(data, *track, observation, &error_px) ||
        error_px.norm() > options.outlier_sigmas * observation.sigma_px) {
      ++result.removed;
      continue;
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

void BundleAdjustmentOptions::validate() const {
  requireField(max_iterations >= 1, "max_iterations", "must be 1 or more", max_iterations);
  requireField(loss_sigmas > 0.0, "loss_sigmas", "must be positive", loss_sigmas);
  requireField(outlier_sigmas > 0.0, "outlier_sigmas", "must be positive", outlier_sigmas);
  requireField(min_parallax_rad >= 0.0, "min_parallax_rad", "must not be negative", min_parallax_rad);
  requireField(min_observations >= 2, "min_observations", "must be 2 or more", min_observations);
  requireField(max_range_m > 0.0, "max_range_m", "must be positive", max_range_m);
  requireField(odometer_scale_sigma > 0.0, "odometer_scale_sigma", "must be positive", odometer_scale_sigma);
  requireField(odometer_turn_sigma > 0.0, "odometer_turn_sigma", "must be positive", odometer_turn_sigma);
  requireField(odometry_distance_sigma >= 0.0, "odometry_distance_sigma", "must not be negative",
               odometry_distance_sigma);
  requireField(odometry_sigma_m > 0.0, "odometry_sigma_m", "must be positive", odometry_sigma_m);
  requireField(odometry_turn_sigma >= 0.0, "odometry_turn_sigma", "must not be negative",
               odometry_turn_sigma);
  requireField(odometry_sigma_rad > 0.0, "odometry_sigma_rad", "must be positive", odometry_sigma_rad);
  requireField(height_sigma_m > 0.0, "height_sigma_m", "must be positive", height_sigma_m);
  requireField(tilt_sigma_rad > 0.0, "tilt_sigma_rad", "must be positive", tilt_sigma_rad);
}

BundleAdjustmentSummary adjustBundle(const BundleAdjustmentOptions& options, MappingData* data) {
  options.validate();
  check(!data->keyframes.empty(), "adjustBundle: expected keyframes");
  Bundle bundle(options, data);
  const ceres::Solver::Summary solved = bundle.solve();
  bundle.writeBack();
  BundleAdjustmentSummary summary;
  summary.converged = solved.termination_type == ceres::CONVERGENCE;
  summary.num_iterations = static_cast<int>(solved.iterations.size());

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
