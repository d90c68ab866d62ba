#include "vcharge_calibration/monitor/rig_change_detector.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <boost/math/special_functions/gamma.hpp>

#include "rig/body_move.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Errors of a part of a drive: of each camera, of the body on its suspension, and of the odometer.
constexpr double kCamera_m = 0.001;
constexpr double kCamera_rad = 0.0002;
constexpr double kBodyHeight_m = 0.005;
constexpr double kBodyTilt_rad = 0.003;
constexpr double kBodyHeading_rad = 0.001;
constexpr double kDistanceFactor = 0.002;
constexpr double kTurnFactor = 0.01;
constexpr double kTurnPerMetre_rad = 0.0003;
// Deviation of extrinsics without covariance.
constexpr double kRig_m = 0.01;
constexpr double kRig_rad = 0.001;
// Usual factors of an odometer, and sizes of changes.
constexpr double kOdometerFactor = 0.02;
constexpr double kUsualTurnPerMetre_rad = 0.002;
constexpr double kChange_m = 0.02;
constexpr double kChange_rad = 0.03;
/// Earlier parts of the drive are summed up.
constexpr size_t kMaxObservations = 200;
/// The last parts of a drive may be the first ones after a change; an earlier one that contradicts those
/// before and after it is left out.
constexpr size_t kNumUndecided = 3;
constexpr double kSingleRatio = 0.5;
// A change in nearly the same direction, soon after another one, goes on with it.
constexpr double kMaxPause_m = 500.0;
constexpr double kSameDirection = 0.7;
/// Changes at different times are not independent.
constexpr double kIndependentTimes = 20.0;

double squared(double value) {
  return value * value;
}

Eigen::Vector3d odometerSigmas(double factor, double turn_factor, double turn_per_metre_rad) {
  return {factor, turn_factor, turn_per_metre_rad};
}

/// Derivative of the deviation by a motion of the body: how its cameras move in the frame of the wheels, by
/// [dt, dphi] of the body.
Eigen::MatrixXd byBody(const CameraRig& rig) {
  Eigen::MatrixXd by_body = Eigen::MatrixXd::Zero(RigDeviation::rowOf(rig.cameras.size()), 6);
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    by_body.middleRows<6>(RigDeviation::rowOf(i)) = byMoveOfBody(*rig.cameras[i].vehicle_from_camera);
  }
  return by_body;
}

/// Logarithm of the probability that a chi-square variable exceeds `value`.
double logChiSquareTail(double value, Eigen::Index degrees) {
  const double half = 0.5 * static_cast<double>(degrees), x = 0.5 * std::max(0.0, value);
  const double tail = boost::math::gamma_q(half, x);
  return tail > 1e-290 ? std::log(tail) : -x + (half - 1.0) * std::log(x) - std::lgamma(half);
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix) {
  return matrix.llt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

}  // namespace

Eigen::Index RigChange::mainAxis() const {
  Eigen::Index axis = 0;
  size.cwiseAbs().cwiseQuotient(covariance.diagonal().cwiseSqrt()).maxCoeff(&axis);
  return axis;
}

RigChangeDetector::Belief& RigChangeDetector::Belief::operator+=(const Belief& other) {
  information += other.information;
  vector += other.vector;
  return *this;
}

RigChangeDetector::Belief& RigChangeDetector::Belief::operator-=(const Belief& other) {
  information -= other.information;
  vector -= other.vector;
  return *this;
}

RigChangeDetector::RigChangeDetector(const CameraRig& rig, double false_alarms_per_km)
    : false_alarms_per_km_(false_alarms_per_km) {
  check(false_alarms_per_km > 0.0, "RigChangeDetector: expected a positive rate of false alarms");
  check(rig.hasExtrinsics(), "RigChangeDetector: expected extrinsics");
  const Eigen::Index size = RigDeviation::rowOf(rig.cameras.size());
  start_ = {Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  const Eigen::Vector3d usual = odometerSigmas(kOdometerFactor, kOdometerFactor, kUsualTurnPerMetre_rad);
  start_.information.diagonal().head<3>() = usual.cwiseAbs2().cwiseInverse();

  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(size, size);
  own.diagonal().head<3>() = odometerSigmas(kDistanceFactor, kTurnFactor, kTurnPerMetre_rad).cwiseAbs2();
  Eigen::Matrix<double, 6, 1> camera_sigmas, body_sigmas, change_sigmas;
  camera_sigmas << Eigen::Vector3d::Constant(kCamera_m), Eigen::Vector3d::Constant(kCamera_rad);
  body_sigmas << 0.0, 0.0, kBodyHeight_m, kBodyTilt_rad, kBodyTilt_rad, kBodyHeading_rad;
  change_sigmas << Eigen::Vector3d::Constant(kChange_m), Eigen::Vector3d::Constant(kChange_rad);
  const Eigen::MatrixXd by_body = byBody(rig);
  own += by_body * body_sigmas.cwiseAbs2().asDiagonal() * by_body.transpose();

  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const Eigen::Index row = RigDeviation::rowOf(i);
    own.diagonal().segment<6>(row) += camera_sigmas.cwiseAbs2();
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    covariance.diagonal() << Eigen::Vector3d::Constant(squared(kRig_m)),
        Eigen::Vector3d::Constant(squared(kRig_rad));
    start_.information.block<6, 6>(row, row) = inverse(rig.cameras[i].covariance.value_or(covariance));
    Hypothesis moved{RigPart::kCamera, i, Eigen::MatrixXd::Zero(size, 6),
                     change_sigmas.cwiseAbs2().cwiseInverse().asDiagonal()};
    moved.by_size.middleRows<6>(row).setIdentity();
    hypotheses_.push_back(moved);
  }
  Hypothesis odometer{RigPart::kOdometer, 0, Eigen::MatrixXd::Zero(size, 3),
                      usual.cwiseAbs2().cwiseInverse().asDiagonal()};
  odometer.by_size.topRows<3>().setIdentity();
  hypotheses_.push_back(odometer);
  hypotheses_.push_back({RigPart::kBody, 0, by_body.middleCols<3>(2),
                         change_sigmas.segment<3>(2).cwiseAbs2().cwiseInverse().asDiagonal()});
  own_information_ = inverse(own);
}

/// The information of a part of a drive whose errors have a part in common: of y = x + e + n, with e of
/// covariance S and n of information L, L - L (L + S^-1)^-1 L.
RigChangeDetector::Belief RigChangeDetector::withOwnErrors(const RigDeviation& deviation) const {
  const Eigen::MatrixXd& information = deviation.information;
  const Eigen::VectorXd& vector = deviation.information_vector;
  const Eigen::LLT<Eigen::MatrixXd> sum((information + own_information_).eval());
  Belief belief;
  belief.information = information - information * sum.solve(information);
  belief.information = (0.5 * (belief.information + belief.information.transpose())).eval();
  belief.vector = vector - information * sum.solve(vector);
  return belief;
}

RigChangeDetector::Belief RigChangeDetector::sumOf(size_t begin, size_t end) const {
  Belief sum{Eigen::MatrixXd::Zero(start_.vector.size(), start_.vector.size()),
             Eigen::VectorXd::Zero(start_.vector.size())};
  for (size_t i = begin; i < end; ++i) {
    sum += observations_[i].belief;
  }
  return sum;
}

// Normal equations of the deviation before the change and of the change's size; the former is eliminated.
RigChangeDetector::Test RigChangeDetector::test(const Hypothesis& hypothesis, const Belief& all,
                                                const Eigen::LLT<Eigen::MatrixXd>& all_information,
                                                const Belief& after) {
  const Eigen::MatrixXd by_after = after.information * hypothesis.by_size;
  const Eigen::VectorXd gradient =
      hypothesis.by_size.transpose() * (after.vector - after.information * all_information.solve(all.vector));
  const Eigen::MatrixXd information = hypothesis.by_size.transpose() * by_after -
                                      by_after.transpose() * all_information.solve(by_after) +
                                      hypothesis.size_information;
  Test result;
  result.covariance = inverse(information);
  result.size = result.covariance * gradient;
  result.square = gradient.dot(result.size);
  result.log_probability = logChiSquareTail(result.square, gradient.size());
  return result;
}

std::pair<size_t, RigChangeDetector::Test> RigChangeDetector::weakestTest(const Hypothesis& hypothesis,
                                                                          size_t first) const {
  const Belief after = sumOf(first, observations_.size());
  const Belief all = present();
  std::pair<size_t, Test> weakest;
  weakest.second.square = INFINITY;
  for (size_t i = 0; i < observations_.size(); ++i) {
    Belief others = all, others_after = after;
    others -= observations_[i].belief;
    if (i >= first) {
      others_after -= observations_[i].belief;
    }
    const Eigen::LLT<Eigen::MatrixXd> information(others.information);
    Test without = test(hypothesis, others, information, others_after);
    if (without.square < weakest.second.square) {
      weakest = {i, std::move(without)};
    }
  }
  return weakest;
}

std::optional<RigChange> RigChangeDetector::add(const RigDeviation& deviation) {
  check(deviation.size() == start_.vector.size(), "RigChangeDetector: expected deviations of its rig");
  observations_.push_back({withOwnErrors(deviation), deviation.begin_m, deviation.end_m});
  if (observations_.size() > kMaxObservations) {
    start_ += observations_.front().belief;
    observations_.erase(observations_.begin());
  }
  const double length_km = 1e-3 * (deviation.end_m - deviation.begin_m);
  const double limit = std::log(false_alarms_per_km_ * std::max(1e-4, length_km) /
                                (kIndependentTimes * static_cast<double>(hypotheses_.size())));
  Test best;
  best.log_probability = limit;
  const Hypothesis* best_hypothesis = nullptr;
  size_t best_first = 0;
  Belief after = sumOf(0, observations_.size());
  const Belief all = present();
  const Eigen::LLT<Eigen::MatrixXd> all_information(all.information);
  for (size_t first = 0; first + 1 < observations_.size(); ++first) {
    for (const Hypothesis& hypothesis : hypotheses_) {
      Test found = test(hypothesis, all, all_information, after);
      if (found.log_probability < best.log_probability) {
        best = std::move(found);
        best_hypothesis = &hypothesis;
        best_first = first;
      }
    }
    after -= observations_[first].belief;
  }
  if (best_hypothesis == nullptr) {
    return std::nullopt;
  }
  const auto [decisive, without] = weakestTest(*best_hypothesis, best_first);
  if (without.log_probability >= limit) {
    if (without.square < kSingleRatio * best.square && decisive + kNumUndecided < observations_.size()) {
      observations_.erase(observations_.begin() + static_cast<std::ptrdiff_t>(decisive));
    }
    return std::nullopt;
  }
  RigChange change;
  change.part = best_hypothesis->part;
  change.camera = best_hypothesis->camera;
  change.earliest_m = best_first == 0 ? 0.0 : observations_[best_first - 1].begin_m;
  change.latest_m = observations_[best_first].end_m;
  change.found_m = deviation.end_m;
  change.found = deviation.end;
  change.size = best.size;
  change.covariance = best.covariance;
  change.log_probability = best.log_probability;
  change.is_slow = continuesEarlier(change);
  changes_.push_back(change);
  accept(*best_hypothesis, best_first);
  return change;
}

bool RigChangeDetector::continuesEarlier(const RigChange& change) const {
  const auto earlier = std::find_if(changes_.rbegin(), changes_.rend(), [&](const RigChange& each) {
    return each.part == change.part && each.camera == change.camera;
  });
  if (earlier == changes_.rend() || change.earliest_m - earlier->found_m > kMaxPause_m) {
    return false;
  }
  // Directions are compared in units of the deviations, in which the tests compare them.
  const Eigen::VectorXd sigmas = change.covariance.diagonal().cwiseSqrt();
  return change.size.cwiseQuotient(sigmas).normalized().dot(
             earlier->size.cwiseQuotient(sigmas).normalized()) > kSameDirection;
}

/// From now on the deviation is that after the change; what was known before it holds for the rest.
void RigChangeDetector::accept(const Hypothesis& hypothesis, size_t first) {
  Belief before = start_;
  before += sumOf(0, first);
  // The belief before is widened by the size of the change.
  const Eigen::MatrixXd covariance = inverse(before.information);
  const Eigen::VectorXd mean = covariance * before.vector;
  const Eigen::MatrixXd after =
      covariance + hypothesis.by_size * inverse(hypothesis.size_information) * hypothesis.by_size.transpose();
  start_.information = inverse(after);
  start_.vector = start_.information * mean;
  start_ += sumOf(first, observations_.size());
  observations_.clear();
}

void RigChangeDetector::countFrom(const Eigen::VectorXd& deviation) {
  check(deviation.size() == start_.vector.size(), "RigChangeDetector: expected a deviation of its rig");
  start_.vector -= start_.information * deviation;
  for (Observation& observation : observations_) {
    observation.belief.vector -= observation.belief.information * deviation;
  }
}

RigChangeDetector::Belief RigChangeDetector::present() const {
  Belief now = start_;
  now += sumOf(0, observations_.size());
  return now;
}

Eigen::VectorXd RigChangeDetector::deviation() const {
  const Belief now = present();
  return now.information.llt().solve(now.vector);
}

Eigen::MatrixXd RigChangeDetector::covariance() const {
  return inverse(present().information);
}

}  // namespace vcharge
