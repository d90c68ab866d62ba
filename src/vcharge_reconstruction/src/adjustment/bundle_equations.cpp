#include "adjustment/bundle_equations.h"

#include <algorithm>
#include <optional>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "landmarks/point_tasks.h"
#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_core/motion/pose_step.h"

/// Absent unless the BLAS of this machine, with which CHOLMOD multiplies, is OpenBLAS.
extern "C" __attribute__((weak)) void openblas_set_num_threads(int num_threads);

namespace vcharge {
namespace {

/// Least information of an unknown, for those that no term depends on.
constexpr double kMinInformation = 1e-6;

}  // namespace

BundleEquations::BundleEquations(const BundleProblem& problem, const BundleErrors& errors)
    : problem_(problem), errors_(errors), points_(problem.points_in_map.size()) {
  makeSlots();
  makeCameraTerms();
  makePattern();
  if (openblas_set_num_threads != nullptr) {
    openblas_set_num_threads(1);  // otherwise sums depend on the number of threads
  }
}

void BundleEquations::linearize(const BundleState& state) {
  state_ = state;
  tbb::parallel_for(size_t{0}, points_.size(), [&](size_t point) { linearizePoint(point); });
}

void BundleEquations::addImageErrors(const Eigen::Vector3d& point, Slot* slot, Matrix3Cd* by_camera) const {
  for (size_t i = slot->begin; i < slot->end; ++i) {
    Eigen::Vector2d error;
    Eigen::Matrix<double, 2, 3> by_point, by_deviation;
    if (errors_.reprojection(state_, problem_.observations[i], point, &error, &by_point, &by_deviation)) {
      const Eigen::Matrix<double, 3, 2> weighted =
          errors_.robustWeight(error.squaredNorm()) * by_point.transpose();
      slot->information += weighted * by_point;
      slot->gradient += weighted * error;
      if (by_camera != nullptr) {
        by_camera->middleCols<3>(6) =
            by_point.transpose() * (by_point * by_point.transpose()).inverse() * by_deviation;
      }
    }
  }
}

void BundleEquations::setCameraMoves(const Slot& slot, Matrix3Cd* by_camera) const {
  Eigen::Matrix3d map_from_vehicle = state_.poses[slot.pose].rotationMatrix();
  Eigen::Vector3d in_vehicle_m = map_from_vehicle.transpose() * slot.from_vehicle_m;
  const BundleObservation& observation = problem_.observations[slot.begin];
  if (const std::optional<RigidTransform> motion = errors_.motionToExposure(state_, observation)) {
    map_from_vehicle *= motion->rotationMatrix();
    in_vehicle_m = motion->inverse() * in_vehicle_m;
  }
  const Eigen::Vector3d from_camera_m = in_vehicle_m - state_.vehicle_from_camera[slot.camera].translation();
  by_camera->leftCols<3>() = -map_from_vehicle;
  by_camera->middleCols<3>(3) = map_from_vehicle * crossMatrix(from_camera_m);
  if (hasTimings()) {
    const RigCamera& camera = problem_.rig->cameras[slot.camera];
    const Eigen::Vector3d by_time = -(map_from_vehicle * problem_.rates[slot.pose].velocityOf(in_vehicle_m));
    by_camera->col(timingInCamera()) =
        camera.timing.lineAt(observation.position_px, camera.image_size_px) * by_time;
    by_camera->col(timingInCamera() + 1) = by_time;
  }
}

void BundleEquations::addGroundError(Slot* slot) const {
  Eigen::RowVector3d by_point;
  const double error = errors_.ground(state_, problem_.ground_observations[slot->begin], &by_point);
  const Eigen::Vector3d weighted = errors_.robustWeight(error * error) * by_point.transpose();
  slot->information += weighted * by_point;
  slot->gradient += weighted * error;
}

void BundleEquations::linearizePoint(size_t point) {
  const Eigen::Vector3d& position = state_.points[point];
  const auto cameras = cameras_.begin() + static_cast<std::ptrdiff_t>(first_camera_of_point_[point]);
  const auto end_cameras = cameras_.begin() + static_cast<std::ptrdiff_t>(first_camera_of_point_[point + 1]);
  std::for_each(cameras, end_cameras, [&](CameraTerms& terms) { terms.with_point.setZero(cameraSize(), 3); });
  for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
    Slot& slot = slots_[s];
    slot.information.setZero();
    slot.gradient.setZero();
    if (slot.is_ground) {
      addGroundError(&slot);
    } else {
      addImageErrors(position, &slot, hasDeviations() ? &camera_slots_[s].by_camera : nullptr);
    }
    slot.from_vehicle_m = position - state_.poses[slot.pose].translation();
    slot.with_point.topRows<3>() = -slot.information;
    slot.with_point.bottomRows<3>() = -crossMatrix(slot.from_vehicle_m) * slot.information;
    if (hasCamera(slot)) {
      CameraSlot& of_slot = camera_slots_[s];
      setCameraMoves(slot, &of_slot.by_camera);
      of_slot.camera_with_point = of_slot.by_camera.transpose() * slot.information;
      const auto of_camera = std::find_if(
          cameras, end_cameras, [&](const CameraTerms& terms) { return terms.camera == slot.camera; });
      of_camera->with_point += of_slot.camera_with_point;
    }
  }
}

void BundleEquations::eliminatePoint(size_t point, double damping) {
  PointTerms& terms = points_[point];
  Eigen::Matrix3d information = errors_.pointInformation(point);
  terms.gradient = information * (state_.points[point] - problem_.points_in_map[point]);
  for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
    information += slots_[s].information;
    terms.gradient += slots_[s].gradient;
  }
  terms.damping = damping * information.diagonal().cwiseMax(kMinInformation);
  information.diagonal() += terms.damping;
  terms.inverse = information.inverse();
  for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
    slots_[s].over_point = slots_[s].with_point * terms.inverse;
  }
}

BundleEquations::PriorTerms BundleEquations::priorTerms() const {
  PriorTerms terms;
  terms.own.assign(slots_of_pose_.size(), Matrix6d::Zero());
  terms.with_previous.assign(slots_of_pose_.size(), Matrix6d::Zero());
  terms.with_tail.setZero(tailColumn(), tailSize());
  terms.gradient.setZero(tailColumn() + tailSize());
  const Eigen::Vector2d prior_information = problem_.odometer_sigmas.cwiseAbs2().cwiseInverse();
  terms.tail.setZero(tailSize(), tailSize());
  terms.tail.topLeftCorner<2, 2>() = prior_information.asDiagonal();
  auto odometer_gradient = terms.gradient.segment<2>(tailColumn());
  odometer_gradient = errors_.odometerPrior(state_).cwiseQuotient(problem_.odometer_sigmas);
  for (size_t i = 0; i < problem_.odometer_factors.size(); ++i) {
    const auto pose = static_cast<size_t>(problem_.odometer_factors[i].pose);
    const OdometerError motion = errors_.odometerFactor(state_, i);
    terms.own[pose] += motion.by_current.transpose() * motion.by_current;
    terms.gradient.segment<6>(columnOf(pose)) += motion.by_current.transpose() * motion.error;
    terms.with_tail.block<6, 2>(columnOf(pose), 0) += motion.by_current.transpose() * motion.by_odometer;
    if (isFree(pose - 1)) {
      terms.own[pose - 1] += motion.by_previous.transpose() * motion.by_previous;
      terms.with_previous[pose] += motion.by_previous.transpose() * motion.by_current;
      terms.gradient.segment<6>(columnOf(pose - 1)) += motion.by_previous.transpose() * motion.error;
      terms.with_tail.block<6, 2>(columnOf(pose - 1), 0) +=
          motion.by_previous.transpose() * motion.by_odometer;
    }
    terms.tail.topLeftCorner<2, 2>() += motion.by_odometer.transpose() * motion.by_odometer;
    odometer_gradient += motion.by_odometer.transpose() * motion.error;
  }
  addCameraPriors(&terms);
  return terms;
}

void BundleEquations::addCameraPriors(PriorTerms* terms) const {
  const Eigen::VectorXd moved = problem_.extrinsics_information * errors_.cameraMoves(state_);
  for (size_t i = 0; i < problem_.prior_vehicle_from_camera.size(); ++i) {
    const Eigen::Index row = cameraInTail(static_cast<int32_t>(i));
    const auto own = static_cast<Eigen::Index>(6 * i);
    terms->gradient.segment<6>(tailColumn() + row) += moved.segment<6>(own);
    for (size_t other = 0; other < problem_.prior_vehicle_from_camera.size(); ++other) {
      terms->tail.block<6, 6>(row, cameraInTail(static_cast<int32_t>(other))) +=
          problem_.extrinsics_information.block<6, 6>(own, static_cast<Eigen::Index>(6 * other));
    }
  }
  for (size_t i = 0; i < problem_.image_deviations.size(); ++i) {
    const Eigen::Vector3d weights = problem_.image_deviation_sigmas[i].cwiseInverse();
    const Eigen::Index row = cameraInTail(static_cast<int32_t>(i)) + 6;
    terms->tail.diagonal().segment<3>(row) += weights.cwiseAbs2();
    terms->gradient.segment<3>(tailColumn() + row) +=
        weights.cwiseProduct(errors_.imageDeviationPrior(state_, i));
  }
  for (size_t i = 0; i < problem_.timing_deviations.size(); ++i) {
    const Eigen::Vector2d weights = problem_.timing_deviation_sigmas[i].cwiseInverse();
    const Eigen::Index row = cameraInTail(static_cast<int32_t>(i)) + timingInCamera();
    terms->tail.diagonal().segment<2>(row) += weights.cwiseAbs2();
    terms->gradient.segment<2>(tailColumn() + row) +=
        weights.cwiseProduct(errors_.timingDeviationPrior(state_, i));
  }
  if (hasTimings()) {
    Eigen::VectorXd by_common = Eigen::VectorXd::Zero(tailSize());
    for (size_t i = 0; i < problem_.timing_deviations.size(); ++i) {
      by_common[cameraInTail(static_cast<int32_t>(i)) + timingInCamera() + 1] =
          1.0 / (static_cast<double>(problem_.timing_deviations.size()) * problem_.common_clock_sigma_s);
    }
    terms->tail += by_common * by_common.transpose();
    terms->gradient.tail(tailSize()) += errors_.commonClockPrior(state_) * by_common;
  }
}

bool BundleEquations::hasOwnDerivatives(const BundleObservation& observation) const {
  return hasDeviations() || hasTimings() ||
         (hasCameras() && !problem_.rates.empty() &&
          !problem_.rig->cameras[observation.camera].timing.isInstant());
}

BundleEquations::TailTerms BundleEquations::tailTerms() const {
  TailTerms zero;
  zero.information.setZero(tailSize(), tailSize());
  zero.gradient.setZero(tailSize());
  zero.reduced_gradient.setZero(tailSize());
  zero.diagonal.setZero(tailSize());
  if (!hasCameras()) {
    return zero;
  }
  const Eigen::Index size = cameraSize();
  // A fixed number of points per task, summed in order: the same result on any number of threads.
  constexpr size_t kPointsPerTask = 1024;
  std::vector<TailTerms> of_task((points_.size() + kPointsPerTask - 1) / kPointsPerTask, zero);
  tbb::parallel_for(size_t{0}, of_task.size(), [&](size_t task) {
    TailTerms& terms = of_task[task];
    const size_t end = std::min(points_.size(), (task + 1) * kPointsPerTask);
    for (size_t point = task * kPointsPerTask; point < end; ++point) {
      for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
        const Slot& slot = slots_[s];
        if (!hasCamera(slot)) {
          continue;
        }
        const CameraSlot& of_camera = camera_slots_[s];
        const Eigen::Index row = cameraInTail(slot.camera);
        const auto own = (of_camera.camera_with_point * of_camera.by_camera).eval();
        const auto gradient = (of_camera.by_camera.transpose() * slot.gradient).eval();
        terms.information.block(row, row, size, size) += own;
        terms.diagonal.segment(row, size) += own.diagonal();
        terms.gradient.segment(row, size) += gradient;
        terms.reduced_gradient.segment(row, size) += gradient;
      }
      for (size_t c = first_camera_of_point_[point]; c < first_camera_of_point_[point + 1]; ++c) {
        const Eigen::Index row = cameraInTail(cameras_[c].camera);
        const MatrixC3d over_point = cameras_[c].with_point * points_[point].inverse;
        terms.reduced_gradient.segment(row, size) -= over_point * points_[point].gradient;
        for (size_t other = first_camera_of_point_[point]; other < first_camera_of_point_[point + 1];
             ++other) {
          terms.information.block(row, cameraInTail(cameras_[other].camera), size, size).noalias() -=
              over_point * cameras_[other].with_point.transpose();
        }
      }
    }
  });
  for (const TailTerms& terms : of_task) {
    zero.information += terms.information;
    zero.gradient += terms.gradient;
    zero.reduced_gradient += terms.reduced_gradient;
    zero.diagonal += terms.diagonal;
  }
  return zero;
}

void BundleEquations::assemble(double damping) {
  PriorTerms priors = priorTerms();
  gradient_ = priors.gradient;
  reduced_gradient_.setZero(gradient_.size());
  damping_.setZero(gradient_.size());
  tbb::enumerable_thread_specific<Scratch> scratch;
  tbb::parallel_for(firstFreePose(), slots_of_pose_.size(),
                    [&](size_t pose) { assemblePose(pose, damping, &priors, &scratch.local()); });
  assembleTail(damping, priors);
}

// Each pose writes its own columns, with sums in a fixed order.
void BundleEquations::assemblePose(size_t pose, double damping, PriorTerms* priors, Scratch* scratch) {
  const std::vector<int32_t>& rows = rows_of_pose_[pose];
  scratch->block_of_pose.resize(slots_of_pose_.size());
  scratch->blocks.assign(rows.size(), Matrix6d::Zero());
  for (size_t k = 0; k < rows.size(); ++k) {
    scratch->block_of_pose[rows[k]] = static_cast<int32_t>(k);
  }
  Matrix6d& own = scratch->blocks.back();
  own = priors->own[pose];
  Vector6d gradient = gradient_.segment<6>(columnOf(pose));
  Vector6d eliminated = Vector6d::Zero();
  for (const size_t s : slots_of_pose_[pose]) {
    const Slot& slot = slots_[s];
    const Eigen::Matrix3d cross = crossMatrix(slot.from_vehicle_m);
    own.leftCols<3>() -= slot.with_point;
    own.rightCols<3>() += slot.with_point * cross;
    gradient.head<3>() -= slot.gradient;
    gradient.tail<3>() -= cross * slot.gradient;
    eliminated += slot.over_point * points_[slot.point].gradient;
  }
  gradient_.segment<6>(columnOf(pose)) = gradient;
  reduced_gradient_.segment<6>(columnOf(pose)) = gradient - eliminated;
  damping_.segment<6>(columnOf(pose)) = damping * own.diagonal().cwiseMax(kMinInformation);
  own.diagonal() += damping_.segment<6>(columnOf(pose));
  if (pose > firstFreePose()) {
    scratch->blocks[scratch->block_of_pose[pose - 1]] += priors->with_previous[pose];
  }
  for (const size_t s : slots_of_pose_[pose]) {
    for (size_t other = first_slot_of_point_[slots_[s].point]; other <= s; ++other) {
      if (isFree(slots_[other].pose)) {
        const Matrix6d product = slots_[other].over_point * slots_[s].with_point.transpose();
        Matrix6d& block = scratch->blocks[scratch->block_of_pose[slots_[other].pose]];
        block -= product;
        if (other < s && slots_[other].pose == slots_[s].pose) {
          block -= product.transpose();
        }
      }
    }
  }
  if (hasCameras()) {
    for (const size_t s : slots_of_pose_[pose]) {
      const Slot& slot = slots_[s];
      const auto withCamera = [&](int32_t camera) {
        return priors->with_tail.block(columnOf(pose), cameraInTail(camera), 6, cameraSize());
      };
      if (hasCamera(slot)) {
        withCamera(slot.camera).noalias() += slot.with_point * camera_slots_[s].by_camera;
      }
      for (size_t c = first_camera_of_point_[slot.point]; c < first_camera_of_point_[slot.point + 1]; ++c) {
        withCamera(cameras_[c].camera).noalias() -= slot.over_point * cameras_[c].with_point.transpose();
      }
    }
  }
  double* value = reduced_.valuePtr() + reduced_.outerIndexPtr()[columnOf(pose)];
  for (int i = 0; i < 6; ++i) {
    for (size_t k = 0; k < rows.size(); ++k) {
      value = std::copy_n(scratch->blocks[k].col(i).data(), k + 1 == rows.size() ? i + 1 : 6, value);
    }
  }
}

void BundleEquations::assembleTail(double damping, const PriorTerms& priors) {
  const TailTerms tail = tailTerms();
  const Eigen::MatrixXd information = priors.tail + tail.information;
  reduced_gradient_.tail(tailSize()) = gradient_.tail(tailSize()) + tail.reduced_gradient;
  gradient_.tail(tailSize()) += tail.gradient;
  damping_.tail(tailSize()) = damping * (priors.tail.diagonal() + tail.diagonal).cwiseMax(kMinInformation);
  for (Eigen::Index i = 0; i < tailSize(); ++i) {
    double* value = reduced_.valuePtr() + reduced_.outerIndexPtr()[tailColumn() + i];
    value = std::copy_n(priors.with_tail.col(i).data(), tailColumn(), value);
    for (Eigen::Index k = 0; k <= i; ++k) {
      *value++ = information(k, i) + (k == i ? damping_[tailColumn() + i] : 0.0);
    }
  }
}

double BundleEquations::step(double damping, BundleState* next) {
  tbb::parallel_for(size_t{0}, points_.size(), [&](size_t point) { eliminatePoint(point, damping); });
  assemble(damping);
  factorization_.factorize(reduced_);
  if (factorization_.info() != Eigen::Success) {
    return 0.0;
  }
  const Eigen::VectorXd change = factorization_.solve(-reduced_gradient_);
  if (!change.allFinite()) {
    return 0.0;
  }
  *next = state_;
  for (size_t pose = firstFreePose(); pose < slots_of_pose_.size(); ++pose) {
    next->poses[pose] = moved(state_.poses[pose], change.segment<6>(columnOf(pose)));
  }
  next->odometer += change.segment<2>(tailColumn());
  for (size_t i = 0; i < problem_.vehicle_from_camera.size(); ++i) {
    const Eigen::Index column = tailColumn() + cameraInTail(static_cast<int32_t>(i));
    next->moveCamera(i, change.segment<6>(column));
    if (hasDeviations()) {
      next->image_deviations[i] += change.segment<3>(column + 6);
    }
    if (hasTimings()) {
      next->timing_deviations[i] += change.segment<2>(column + timingInCamera());
    }
  }
  // Decrease of the linear model: d^T (damping d - gradient) / 2.
  const double by_poses = 0.5 * change.dot(damping_.cwiseProduct(change) - gradient_);
  return by_poses + sumOverPoints(points_.size(), [&](size_t point) {
           const PointTerms& terms = points_[point];
           Eigen::Vector3d gradient = terms.gradient;
           for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
             if (isFree(slots_[s].pose)) {
               gradient += slots_[s].with_point.transpose() * change.segment<6>(columnOf(slots_[s].pose));
             }
             if (hasCamera(slots_[s])) {
               gradient += camera_slots_[s].camera_with_point.transpose() *
                           change.segment(tailColumn() + cameraInTail(slots_[s].camera), cameraSize());
             }
           }
           const Eigen::Vector3d move = -(terms.inverse * gradient);
           next->points[point] += move;
           return 0.5 * move.dot(terms.damping.cwiseProduct(move) - terms.gradient);
         });
}

}  // namespace vcharge
