#include "adjustment/bundle_equations.h"

#include <algorithm>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "landmarks/point_tasks.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

/// Of an unknown that the errors do not depend on.
constexpr double kMinInformation = 1e-6;

}  // namespace

BundleEquations::BundleEquations(const BundleProblem& problem, const BundleErrors& errors)
    : problem_(problem), errors_(errors), points_(problem.points_in_map.size()) {
  makeSlots();
  makePattern();
}

void BundleEquations::makeSlots() {
  slots_of_pose_.resize(problem_.map_from_vehicle.size());
  for (size_t point = 0; point < points_.size(); ++point) {
    first_slot_of_point_.push_back(slots_.size());
    for (size_t i = problem_.first_observation[point]; i < problem_.first_observation[point + 1]; ++i) {
      const int32_t pose = problem_.observations[i].pose;
      const int32_t camera = problem_.observations[i].camera;
      if (slots_.size() == first_slot_of_point_.back() || slots_.back().pose != pose ||
          (hasCameras() && slots_.back().camera != camera)) {
        slots_of_pose_[pose].push_back(slots_.size());
        Slot slot;
        slot.pose = pose;
        slot.point = static_cast<int32_t>(point);
        slot.camera = camera;
        slots_.push_back(slot);
      }
    }
  }
  first_slot_of_point_.push_back(slots_.size());
}

void BundleEquations::makePattern() {
  const size_t num_poses = slots_of_pose_.size();
  rows_of_pose_.resize(num_poses);
  tbb::parallel_for(size_t{1}, num_poses, [&](size_t pose) {
    std::vector<bool> is_row(pose + 1, false);
    is_row[pose] = true;
    is_row[pose - 1] = true;  // by odometry
    for (const size_t s : slots_of_pose_[pose]) {
      for (size_t other = first_slot_of_point_[slots_[s].point]; other < s; ++other) {
        is_row[slots_[other].pose] = true;
      }
    }
    for (size_t other = 1; other <= pose; ++other) {
      if (is_row[other]) {
        rows_of_pose_[pose].push_back(static_cast<int32_t>(other));
      }
    }
  });
  std::vector<int> starts{0};
  for (size_t pose = 1; pose < num_poses; ++pose) {
    for (int i = 1; i <= 6; ++i) {
      starts.push_back(starts.back() + 6 * static_cast<int>(rows_of_pose_[pose].size() - 1) + i);
    }
  }
  for (int i = 1; i <= tailSize(); ++i) {
    starts.push_back(starts.back() + static_cast<int>(tailColumn()) + i);
  }
  reduced_.resize(tailColumn() + tailSize(), tailColumn() + tailSize());
  reduced_.resizeNonZeros(starts.back());
  std::copy(starts.begin(), starts.end(), reduced_.outerIndexPtr());
  int* inner = reduced_.innerIndexPtr();
  for (size_t pose = 1; pose < num_poses; ++pose) {
    for (int i = 0; i < 6; ++i) {
      for (const int32_t row : rows_of_pose_[pose]) {
        const int num_rows = static_cast<size_t>(row) == pose ? i + 1 : 6;
        for (int k = 0; k < num_rows; ++k) {
          *inner++ = static_cast<int>(columnOf(row)) + k;
        }
      }
    }
  }
  for (int i = 0; i < tailSize(); ++i) {
    for (int k = 0; k <= tailColumn() + i; ++k) {
      *inner++ = k;
    }
  }
  factorization_.analyzePattern(reduced_);
}

void BundleEquations::linearize(const BundleState& state) {
  state_ = state;
  tbb::parallel_for(size_t{0}, points_.size(), [&](size_t point) { linearizePoint(point); });
}

void BundleEquations::linearizePoint(size_t point) {
  const Eigen::Vector3d& position = state_.points[point];
  size_t observation = problem_.first_observation[point];
  for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
    Slot& slot = slots_[s];
    slot.information.setZero();
    slot.gradient.setZero();
    for (; observation < problem_.first_observation[point + 1] &&
           problem_.observations[observation].pose == slot.pose &&
           (!hasCameras() || problem_.observations[observation].camera == slot.camera);
         ++observation) {
      Eigen::Vector2d error;
      Eigen::Matrix<double, 2, 3> by_point;
      if (errors_.ofObservation(state_, observation, position, &error, &by_point)) {
        const Eigen::Matrix<double, 3, 2> weighted =
            errors_.robustWeight(error.squaredNorm()) * by_point.transpose();
        slot.information += weighted * by_point;
        slot.gradient += weighted * error;
      }
    }
    slot.from_vehicle_m = position - state_.poses[slot.pose].translation();
    slot.with_point.topRows<3>() = -slot.information;
    slot.with_point.bottomRows<3>() = -crossMatrix(slot.from_vehicle_m) * slot.information;
    if (hasCamera(slot)) {
      const Eigen::Matrix3d map_from_vehicle = state_.poses[slot.pose].rotationMatrix();
      const Eigen::Vector3d from_camera_m = map_from_vehicle.transpose() * slot.from_vehicle_m -
                                            state_.vehicle_from_camera[slot.camera].translation();
      slot.by_camera.leftCols<3>() = -map_from_vehicle;
      slot.by_camera.rightCols<3>() = map_from_vehicle * crossMatrix(from_camera_m);
      slot.camera_with_point = slot.by_camera.transpose() * slot.information;
    }
  }
}

void BundleEquations::eliminatePoint(size_t point, double damping) {
  PointTerms& terms = points_[point];
  Eigen::Matrix3d information = errors_.priorInformation(point);
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

BundleEquations::MotionTerms BundleEquations::motionTerms() const {
  MotionTerms terms;
  terms.own.assign(slots_of_pose_.size(), Matrix6d::Zero());
  terms.with_previous.assign(slots_of_pose_.size(), Matrix6d::Zero());
  terms.with_tail.setZero(tailColumn(), tailSize());
  terms.gradient.setZero(tailColumn() + tailSize());
  const Eigen::Vector2d prior_information = problem_.odometer_sigmas.cwiseAbs2().cwiseInverse();
  terms.tail.setZero(tailSize(), tailSize());
  terms.tail.topLeftCorner<2, 2>() = prior_information.asDiagonal();
  auto odometer_gradient = terms.gradient.segment<2>(tailColumn());
  odometer_gradient = errors_.ofOdometer(state_).cwiseQuotient(problem_.odometer_sigmas);
  for (size_t i = 0; i < problem_.motions.size(); ++i) {
    const auto pose = static_cast<size_t>(problem_.motions[i].pose);
    const MotionError motion = errors_.ofMotion(state_, i);
    terms.own[pose] += motion.by_current.transpose() * motion.by_current;
    terms.gradient.segment<6>(columnOf(pose)) += motion.by_current.transpose() * motion.error;
    terms.with_tail.block<6, 2>(columnOf(pose), 0) += motion.by_current.transpose() * motion.by_odometer;
    if (pose > 1) {
      terms.own[pose - 1] += motion.by_previous.transpose() * motion.by_previous;
      terms.with_previous[pose] += motion.by_previous.transpose() * motion.by_current;
      terms.gradient.segment<6>(columnOf(pose - 1)) += motion.by_previous.transpose() * motion.error;
      terms.with_tail.block<6, 2>(columnOf(pose - 1), 0) +=
          motion.by_previous.transpose() * motion.by_odometer;
    }
    terms.tail.topLeftCorner<2, 2>() += motion.by_odometer.transpose() * motion.by_odometer;
    odometer_gradient += motion.by_odometer.transpose() * motion.error;
  }
  if (hasCameras()) {
    Eigen::MatrixXd common(6, tailSize() - 2);
    for (size_t i = 0; i < problem_.vehicle_from_camera.size(); ++i) {
      common.middleCols<6>(static_cast<Eigen::Index>(6 * i)) = errors_.commonMotionByCamera(i);
    }
    terms.tail.bottomRightCorner(tailSize() - 2, tailSize() - 2) +=
        common.transpose() * problem_.common_information * common;
    terms.gradient.tail(tailSize() - 2) +=
        common.transpose() * (problem_.common_information * errors_.commonMotion(state_));
  }
  return terms;
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
  // A fixed number of points per task, added up in order: the same sums on any number of threads.
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
        const Eigen::Index row = cameraInTail(slot.camera);
        const Matrix6d own = slot.camera_with_point * slot.by_camera;
        const Vector6d gradient = slot.by_camera.transpose() * slot.gradient;
        const Matrix63d over_point = slot.camera_with_point * points_[point].inverse;
        terms.information.block<6, 6>(row, row) += own;
        terms.diagonal.segment<6>(row) += own.diagonal();
        terms.gradient.segment<6>(row) += gradient;
        terms.reduced_gradient.segment<6>(row) += gradient - over_point * points_[point].gradient;
        for (size_t other = first_slot_of_point_[point]; other < first_slot_of_point_[point + 1]; ++other) {
          if (hasCamera(slots_[other])) {
            terms.information.block<6, 6>(row, cameraInTail(slots_[other].camera)).noalias() -=
                over_point * slots_[other].camera_with_point.transpose();
          }
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
  MotionTerms motions = motionTerms();
  gradient_ = motions.gradient;
  reduced_gradient_.setZero(gradient_.size());
  damping_.setZero(gradient_.size());
  tbb::enumerable_thread_specific<Scratch> scratch;
  tbb::parallel_for(size_t{1}, slots_of_pose_.size(),
                    [&](size_t pose) { assemblePose(pose, damping, &motions, &scratch.local()); });
  assembleTail(damping, motions);
}

// A pose owns its columns, and adds up in a fixed order.
void BundleEquations::assemblePose(size_t pose, double damping, MotionTerms* motions, Scratch* scratch) {
  const std::vector<int32_t>& rows = rows_of_pose_[pose];
  scratch->block_of_pose.resize(slots_of_pose_.size());
  scratch->blocks.assign(rows.size(), Matrix6d::Zero());
  for (size_t k = 0; k < rows.size(); ++k) {
    scratch->block_of_pose[rows[k]] = static_cast<int32_t>(k);
  }
  Matrix6d& own = scratch->blocks.back();
  own = motions->own[pose];
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
  if (pose > 1) {
    scratch->blocks[scratch->block_of_pose[pose - 1]] += motions->with_previous[pose];
  }
  for (const size_t s : slots_of_pose_[pose]) {
    for (size_t other = first_slot_of_point_[slots_[s].point]; other <= s; ++other) {
      if (slots_[other].pose > 0) {
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
        return motions->with_tail.block<6, 6>(columnOf(pose), cameraInTail(camera));
      };
      if (hasCamera(slot)) {
        withCamera(slot.camera).noalias() += slot.with_point * slot.by_camera;
      }
      for (size_t other = first_slot_of_point_[slot.point]; other < first_slot_of_point_[slot.point + 1];
           ++other) {
        if (hasCamera(slots_[other])) {
          withCamera(slots_[other].camera).noalias() -=
              slot.over_point * slots_[other].camera_with_point.transpose();
        }
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

void BundleEquations::assembleTail(double damping, const MotionTerms& motions) {
  const TailTerms tail = tailTerms();
  const Eigen::MatrixXd information = motions.tail + tail.information;
  reduced_gradient_.tail(tailSize()) = gradient_.tail(tailSize()) + tail.reduced_gradient;
  gradient_.tail(tailSize()) += tail.gradient;
  damping_.tail(tailSize()) = damping * (motions.tail.diagonal() + tail.diagonal).cwiseMax(kMinInformation);
  for (Eigen::Index i = 0; i < tailSize(); ++i) {
    double* value = reduced_.valuePtr() + reduced_.outerIndexPtr()[tailColumn() + i];
    value = std::copy_n(motions.with_tail.col(i).data(), tailColumn(), value);
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
  for (size_t pose = 1; pose < slots_of_pose_.size(); ++pose) {
    const auto move = change.segment<6>(columnOf(pose));
    next->poses[pose] = RigidTransform(rotationFromVector(move.tail<3>()) * state_.poses[pose].rotation(),
                                       state_.poses[pose].translation() + move.head<3>());
  }
  next->odometer += change.segment<2>(tailColumn());
  for (size_t i = 0; i < problem_.vehicle_from_camera.size(); ++i) {
    next->moveCamera(i, change.segment<6>(tailColumn() + cameraInTail(static_cast<int32_t>(i))));
  }
  // The linear model falls by d^T (damping d - gradient) / 2.
  const double by_poses = 0.5 * change.dot(damping_.cwiseProduct(change) - gradient_);
  return by_poses + sumOverPoints(points_.size(), [&](size_t point) {
           const PointTerms& terms = points_[point];
           Eigen::Vector3d gradient = terms.gradient;
           for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
             if (slots_[s].pose > 0) {
               gradient += slots_[s].with_point.transpose() * change.segment<6>(columnOf(slots_[s].pose));
             }
             if (hasCamera(slots_[s])) {
               gradient += slots_[s].camera_with_point.transpose() *
                           change.segment<6>(tailColumn() + cameraInTail(slots_[s].camera));
             }
           }
           const Eigen::Vector3d move = -(terms.inverse * gradient);
           next->points[point] += move;
           return 0.5 * move.dot(terms.damping.cwiseProduct(move) - terms.gradient);
         });
}

}  // namespace vcharge
