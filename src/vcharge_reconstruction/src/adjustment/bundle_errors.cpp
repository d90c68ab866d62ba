#include "adjustment/bundle_errors.h"

#include <array>
#include <cmath>

#include <ceres/cost_function.h>
#include <ceres/manifold.h>

#include "landmarks/point_tasks.h"
#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_core/motion/pose_step.h"
#include "vcharge_geometry/residuals/pose_block.h"
#include "vcharge_geometry/residuals/rig_costs.h"

namespace vcharge {

BundleState BundleState::of(const BundleProblem& problem) {
  BundleState state{problem.map_from_vehicle, problem.points_in_map,    problem.odometer, {}, {},
                    problem.image_deviations, problem.timing_deviations};
  for (size_t i = 0; i < problem.rig->cameras.size(); ++i) {
    state.vehicle_from_camera.push_back(problem.vehicle_from_camera.empty()
                                            ? *problem.rig->cameras[i].vehicle_from_camera
                                            : problem.vehicle_from_camera[i]);
    state.camera_from_vehicle.push_back(state.vehicle_from_camera.back().inverse());
  }
  return state;
}

void BundleState::moveCamera(size_t camera, const Eigen::Matrix<double, 6, 1>& move) {
  vehicle_from_camera[camera] = moved(vehicle_from_camera[camera], move);
  camera_from_vehicle[camera] = vehicle_from_camera[camera].inverse();
}

BundleErrors::BundleErrors(const BundleProblem& problem)
    : problem_(problem),
      squared_loss_scale_(problem.loss_sigmas * problem.loss_sigmas),
      manifold_(makePoseManifold()) {
  for (const OdometerFactor& factor : problem.odometer_factors) {
    odometer_costs_.push_back(makeOdometryCost(factor.previous_from_current, factor.information));
  }
  for (const RigCamera& camera : problem.rig->cameras) {
    principal_points_px_.push_back(camera.model.principalPoint());
  }
}

BundleErrors::~BundleErrors() = default;

std::optional<RigidTransform> BundleErrors::motionToExposure(const BundleState& state,
                                                             const BundleObservation& observation) const {
  if (problem_.rates.empty()) {
    return std::nullopt;
  }
  const RigCamera& camera = problem_.rig->cameras[observation.camera];
  ImageTiming timing = camera.timing;
  if (!state.timing_deviations.empty()) {
    timing.readout_s += state.timing_deviations[observation.camera][0];
    timing.clock_offset_s += state.timing_deviations[observation.camera][1];
  }
  timing.clock_offset_s += observation.image_offset_s;
  if (timing.isInstant()) {
    return std::nullopt;
  }
  return problem_.rates[observation.pose].motionAfter(
      timing.exposedAt(observation.position_px, camera.image_size_px));
}

bool BundleErrors::reprojection(const BundleState& state, const BundleObservation& observation,
                                const Eigen::Vector3d& point, Eigen::Vector2d* error,
                                Eigen::Matrix<double, 2, 3>* by_point,
                                Eigen::Matrix<double, 2, 3>* by_deviation) const {
  const RigidTransform& pose = state.poses[observation.pose];
  const std::optional<RigidTransform> motion = motionToExposure(state, observation);
  const RigidTransform camera_from_vehicle =
      motion ? state.camera_from_vehicle[observation.camera] * motion->inverse()
             : state.camera_from_vehicle[observation.camera];
  const Eigen::Matrix3d camera_from_map =
      (camera_from_vehicle.rotation() * pose.rotation().conjugate()).toRotationMatrix();
  const Eigen::Vector3d in_camera =
      camera_from_map * (point - pose.translation()) + camera_from_vehicle.translation();
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> pixel_by_point;
  const bool seen = problem_.rig->cameras[observation.camera].model.visit([&](const auto& model) {
    return model.project(in_camera, &pixel, by_point == nullptr ? nullptr : &pixel_by_point);
  });
  if (!seen) {
    error->setConstant(kNoImageResidual);
    return false;
  }
  if (!state.image_deviations.empty()) {
    const ImageDeviation& deviation = state.image_deviations[observation.camera];
    const double magnification = std::exp(deviation[0]);
    const Eigen::Vector2d& centre_px = principal_points_px_[observation.camera];
    const Eigen::Vector2d magnified_px = magnification * (pixel - centre_px);
    pixel = centre_px + magnified_px + deviation.tail<2>();
    if (by_point != nullptr) {
      pixel_by_point *= magnification;
    }
    if (by_deviation != nullptr) {
      *by_deviation << magnified_px / observation.sigma_px,
          Eigen::Matrix2d::Identity() / observation.sigma_px;
    }
  }
  *error = (pixel - observation.position_px) / observation.sigma_px;
  if (by_point != nullptr) {
    *by_point = pixel_by_point * camera_from_map / observation.sigma_px;
  }
  return true;
}

double BundleErrors::ground(const BundleState& state, const GroundObservation& observation,
                            Eigen::RowVector3d* by_point) const {
  const RigidTransform& pose = state.poses[observation.pose];
  const Eigen::RowVector3d up = pose.rotationMatrix().col(2).transpose();
  *by_point = up / observation.sigma_m;
  return up.dot(state.points[observation.point] - pose.translation()) / observation.sigma_m;
}

double BundleErrors::robustCost(double square) const {
  return 0.5 * squared_loss_scale_ * std::log1p(square / squared_loss_scale_);
}

OdometerError BundleErrors::odometerFactor(const BundleState& state, size_t factor) const {
  const auto pose = static_cast<size_t>(problem_.odometer_factors[factor].pose);
  const PoseBlock previous = toPoseBlock(state.poses[pose - 1]);
  const PoseBlock current = toPoseBlock(state.poses[pose]);
  const std::array<const double*, 3> blocks{previous.data(), current.data(), state.odometer.data()};
  OdometerError result;
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> by_previous, by_current;
  Eigen::Matrix<double, 6, 2, Eigen::RowMajor> by_odometer;
  std::array<double*, 3> jacobians{by_previous.data(), by_current.data(), by_odometer.data()};
  odometer_costs_[factor]->Evaluate(blocks.data(), result.error.data(), jacobians.data());
  Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
  manifold_->PlusJacobian(previous.data(), plus.data());
  result.by_previous = by_previous * plus;
  manifold_->PlusJacobian(current.data(), plus.data());
  result.by_current = by_current * plus;
  result.by_odometer = by_odometer;
  return result;
}

Eigen::Vector2d BundleErrors::odometerPrior(const BundleState& state) const {
  return (state.odometer - Eigen::Vector2d::Ones()).cwiseQuotient(problem_.odometer_sigmas);
}

Eigen::VectorXd BundleErrors::cameraMoves(const BundleState& state) const {
  Eigen::VectorXd moves(problem_.extrinsics_information.rows());
  for (size_t i = 0; i < problem_.prior_vehicle_from_camera.size(); ++i) {
    moves.segment<6>(6 * static_cast<Eigen::Index>(i)) =
        stepBetween(problem_.prior_vehicle_from_camera[i], state.vehicle_from_camera[i]);
  }
  return moves;
}

Eigen::Vector3d BundleErrors::imageDeviationPrior(const BundleState& state, size_t camera) const {
  return (state.image_deviations[camera] - problem_.prior_image_deviations[camera])
      .cwiseQuotient(problem_.image_deviation_sigmas[camera]);
}

Eigen::Vector2d BundleErrors::timingDeviationPrior(const BundleState& state, size_t camera) const {
  return (state.timing_deviations[camera] - problem_.prior_timing_deviations[camera])
      .cwiseQuotient(problem_.timing_deviation_sigmas[camera]);
}

double BundleErrors::commonClockPrior(const BundleState& state) const {
  double sum_s = 0.0;
  for (size_t i = 0; i < state.timing_deviations.size(); ++i) {
    sum_s += state.timing_deviations[i][1] - problem_.prior_timing_deviations[i][1];
  }
  return state.timing_deviations.empty()
             ? 0.0
             : sum_s / (static_cast<double>(state.timing_deviations.size()) * problem_.common_clock_sigma_s);
}

double BundleErrors::cost(const BundleState& state) const {
  double cost = sumOverPoints(state.points.size(), [&](size_t point) {
    const Eigen::Vector3d moved_m = state.points[point] - problem_.points_in_map[point];
    double cost_of_point = 0.5 * moved_m.dot(pointInformation(point) * moved_m);
    for (size_t i = problem_.first_observation[point]; i < problem_.first_observation[point + 1]; ++i) {
      Eigen::Vector2d error;
      reprojection(state, problem_.observations[i], state.points[point], &error, nullptr);
      cost_of_point += robustCost(error.squaredNorm());
    }
    return cost_of_point;
  });
  for (const GroundObservation& observation : problem_.ground_observations) {
    Eigen::RowVector3d by_point;
    const double error = ground(state, observation, &by_point);
    cost += robustCost(error * error);
  }
  for (size_t i = 0; i < odometer_costs_.size(); ++i) {
    cost += 0.5 * odometerFactor(state, i).error.squaredNorm();
  }
  for (size_t i = 0; i < state.image_deviations.size(); ++i) {
    cost += 0.5 * imageDeviationPrior(state, i).squaredNorm();
  }
  for (size_t i = 0; i < state.timing_deviations.size(); ++i) {
    cost += 0.5 * timingDeviationPrior(state, i).squaredNorm();
  }
  const double common = commonClockPrior(state);
  cost += 0.5 * common * common;
  const Eigen::VectorXd moves = cameraMoves(state);
  return cost + 0.5 * odometerPrior(state).squaredNorm() +
         0.5 * moves.dot(problem_.extrinsics_information * moves);
}

}  // namespace vcharge
