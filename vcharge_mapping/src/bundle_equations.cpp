#include "bundle_equations.h"

#include <algorithm>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "point_tasks.h"
#include "vcharge_core/cross_matrix.h"

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
      if (slots_.size() == first_slot_of_point_.back() || slots_.back().pose != pose) {
        slots_of_pose_[pose].push_back(slots_.size());
        Slot slot;
        slot.pose = pose;
        slot.point = static_cast<int32_t>(point);
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
  for (int i = 1; i <= 2; ++i) {
    starts.push_back(starts.back() + static_cast<int>(odometerColumn()) + i);
  }
  reduced_.resize(odometerColumn() + 2, odometerColumn() + 2);
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
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k <= odometerColumn() + i; ++k) {
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
           problem_.observations[observation].pose == slot.pose;
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
  }
}

void BundleEquations::eliminatePoint(size_t point, double damping) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  PointTerms& terms = points_[point];
  terms.gradient.setZero();
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
  terms.with_odometer.setZero(odometerColumn(), 2);
  terms.gradient.setZero(odometerColumn() + 2);
  const Eigen::Vector2d prior_information = problem_.odometer_sigmas.cwiseAbs2().cwiseInverse();
  terms.odometer = prior_information.asDiagonal();
  terms.gradient.tail<2>() = errors_.ofOdometer(state_).cwiseQuotient(problem_.odometer_sigmas);
  for (size_t i = 0; i < problem_.motions.size(); ++i) {
    const auto pose = static_cast<size_t>(problem_.motions[i].pose);
    const MotionError motion = errors_.ofMotion(state_, i);
    terms.own[pose] += motion.by_current.transpose() * motion.by_current;
    terms.gradient.segment<6>(columnOf(pose)) += motion.by_current.transpose() * motion.error;
    terms.with_odometer.middleRows<6>(columnOf(pose)) += motion.by_current.transpose() * motion.by_odometer;
    if (pose > 1) {
      terms.own[pose - 1] += motion.by_previous.transpose() * motion.by_previous;
      terms.with_previous[pose] += motion.by_previous.transpose() * motion.by_current;
      terms.gradient.segment<6>(columnOf(pose - 1)) += motion.by_previous.transpose() * motion.error;
      terms.with_odometer.middleRows<6>(columnOf(pose - 1)) +=
          motion.by_previous.transpose() * motion.by_odometer;
    }
    terms.odometer += motion.by_odometer.transpose() * motion.by_odometer;
    terms.gradient.tail<2>() += motion.by_odometer.transpose() * motion.error;
  }
  return terms;
}

void BundleEquations::assemble(double damping) {
  const MotionTerms motions = motionTerms();
  gradient_ = motions.gradient;
  reduced_gradient_.setZero(gradient_.size());
  damping_.setZero(gradient_.size());
  tbb::enumerable_thread_specific<Scratch> scratch;
  tbb::parallel_for(size_t{1}, slots_of_pose_.size(),
                    [&](size_t pose) { assemblePose(pose, damping, motions, &scratch.local()); });
  assembleOdometer(damping, motions);
}

// A pose owns its columns, and adds up in a fixed order.
void BundleEquations::assemblePose(size_t pose, double damping, const MotionTerms& motions,
                                   Scratch* scratch) {
  const std::vector<int32_t>& rows = rows_of_pose_[pose];
  scratch->block_of_pose.resize(slots_of_pose_.size());
  scratch->blocks.assign(rows.size(), Matrix6d::Zero());
  for (size_t k = 0; k < rows.size(); ++k) {
    scratch->block_of_pose[rows[k]] = static_cast<int32_t>(k);
  }
  Matrix6d& own = scratch->blocks.back();
  own = motions.own[pose];
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
    scratch->blocks[scratch->block_of_pose[pose - 1]] += motions.with_previous[pose];
  }
  for (const size_t s : slots_of_pose_[pose]) {
    for (size_t other = first_slot_of_point_[slots_[s].point]; other <= s; ++other) {
      if (slots_[other].pose > 0) {
        scratch->blocks[scratch->block_of_pose[slots_[other].pose]].noalias() -=
            slots_[other].over_point * slots_[s].with_point.transpose();
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

void BundleEquations::assembleOdometer(double damping, const MotionTerms& motions) {
  reduced_gradient_.tail<2>() = gradient_.tail<2>();
  damping_.tail<2>() = damping * motions.odometer.diagonal().cwiseMax(kMinInformation);
  for (int i = 0; i < 2; ++i) {
    double* value = reduced_.valuePtr() + reduced_.outerIndexPtr()[odometerColumn() + i];
    value = std::copy_n(motions.with_odometer.col(i).data(), odometerColumn(), value);
    for (int k = 0; k <= i; ++k) {
      *value++ = motions.odometer(k, i) + (k == i ? damping_[odometerColumn() + i] : 0.0);
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
  next->odometer += change.tail<2>();
  // The linear model falls by d^T (damping d - gradient) / 2.
  const double by_poses = 0.5 * change.dot(damping_.cwiseProduct(change) - gradient_);
  return by_poses + sumOverPoints(points_.size(), [&](size_t point) {
           const PointTerms& terms = points_[point];
           Eigen::Vector3d gradient = terms.gradient;
           for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
             if (slots_[s].pose > 0) {
               gradient += slots_[s].with_point.transpose() * change.segment<6>(columnOf(slots_[s].pose));
             }
           }
           const Eigen::Vector3d move = -(terms.inverse * gradient);
           next->points[point] += move;
           return 0.5 * move.dot(terms.damping.cwiseProduct(move) - terms.gradient);
         });
}

}  // namespace vcharge
