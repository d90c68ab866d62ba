// Covariance of the tail of BundleEquations.
#include <vector>

#include <tbb/parallel_for.h>

#include "adjustment/bundle_equations.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

/// Relative damping that keeps the factorization possible where an unknown is not observed.
constexpr double kTinyDamping = 1e-12;

}  // namespace

Eigen::MatrixXd BundleEquations::pointInfluence(size_t point, const Eigen::MatrixXd& inverse) const {
  Eigen::MatrixXd by_point = Eigen::MatrixXd::Zero(tailSize(), 3);
  for (size_t s = first_slot_of_point_[point]; s < first_slot_of_point_[point + 1]; ++s) {
    const Slot& slot = slots_[s];
    if (isFree(slot.pose)) {
      by_point += inverse.middleRows<6>(columnOf(slot.pose)).transpose() * slot.with_point;
    }
    if (hasCamera(slot)) {
      by_point += inverse.middleRows(tailColumn() + cameraInTail(slot.camera), cameraSize()).transpose() *
                  camera_slots_[s].camera_with_point;
    }
  }
  return -by_point * points_[point].inverse;
}

BundleCovariance BundleEquations::covariance() {
  BundleCovariance result;
  tbb::parallel_for(size_t{0}, points_.size(), [&](size_t point) { eliminatePoint(point, kTinyDamping); });
  assemble(kTinyDamping);
  factorization_.factorize(reduced_);
  if (factorization_.info() != Eigen::Success) {
    return result;
  }
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(tailColumn() + tailSize(), tailSize());
  units.bottomRows(tailSize()).setIdentity();
  // The tail's columns of the inverse: its response to the gradient of each unknown.
  const Eigen::MatrixXd inverse = factorization_.solve(units);
  result.covariance = inverse.bottomRows(tailSize());
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  result.is_valid = result.covariance.allFinite() && (result.covariance.diagonal().array() >= 0.0).all();
  if (!result.is_valid) {
    return result;
  }
  std::vector<Eigen::MatrixXd> by_point(points_.size());
  tbb::parallel_for(size_t{0}, points_.size(),
                    [&](size_t point) { by_point[point] = pointInfluence(point, inverse); });
  result.influence.setZero(tailSize(), static_cast<Eigen::Index>(slots_of_pose_.size()));
  tbb::parallel_for(size_t{0}, slots_of_pose_.size(), [&](size_t pose) {
    auto influence = result.influence.col(static_cast<Eigen::Index>(pose));
    for (const size_t s : slots_of_pose_[pose]) {
      const Slot& slot = slots_[s];
      influence -= by_point[slot.point] * slot.gradient;
      if (isFree(pose)) {
        Vector6d gradient;
        gradient << -slot.gradient, -crossMatrix(slot.from_vehicle_m) * slot.gradient;
        influence -= inverse.middleRows<6>(columnOf(pose)).transpose() * gradient;
      }
      if (hasCamera(slot)) {
        influence -= inverse.middleRows(tailColumn() + cameraInTail(slot.camera), cameraSize()).transpose() *
                     (camera_slots_[s].by_camera.transpose() * slot.gradient);
      }
    }
  });
  for (size_t i = 0; i < problem_.odometer_factors.size(); ++i) {
    const auto pose = static_cast<size_t>(problem_.odometer_factors[i].pose);
    const OdometerError motion = errors_.odometerFactor(state_, i);
    auto influence = result.influence.col(static_cast<Eigen::Index>(pose));
    influence -=
        inverse.middleRows<6>(columnOf(pose)).transpose() * (motion.by_current.transpose() * motion.error);
    if (isFree(pose - 1)) {
      influence -= inverse.middleRows<6>(columnOf(pose - 1)).transpose() *
                   (motion.by_previous.transpose() * motion.error);
    }
    influence -=
        inverse.middleRows<2>(tailColumn()).transpose() * (motion.by_odometer.transpose() * motion.error);
  }
  return result;
}

}  // namespace vcharge
