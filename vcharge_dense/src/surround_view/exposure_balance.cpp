#include "surround_view/exposure_balance.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "surround_view/ground_projection.h"

namespace vcharge {
namespace {

// Gray levels below it are mostly noise; those above are cut off by the sensor.
constexpr uint8_t kDarkest = 8, kBrightest = 245;
constexpr size_t kMinPairs = 20;     // a median needs
constexpr double kFullWeight = 200;  // pairs from which a median has its full weight
// Weights of the last gains, and of lenses without darkening, over that of a median.
constexpr double kKeep = 1e-3, kKeepShading = 1e-2;
constexpr int kNumIterations = 6;
constexpr double kInlier = 0.04;  // logarithms; larger residuals count less
constexpr double kFollow = 0.25;  // part of a difference that one frame corrects
constexpr double kStep = 0.1;     // a larger difference (of logarithms) is a change of the exposure
constexpr double kFollowStep = 0.6;
constexpr double kFollowShading = 0.1;
constexpr double kMaxLogGain = 1.4;  // a factor of 4
constexpr double kMaxShading = 1.0;

std::array<float, 256> makeLogTable() {
  std::array<float, 256> logs{};
  for (size_t gray = 1; gray < logs.size(); ++gray) {
    logs[gray] = std::log(static_cast<float>(gray));
  }
  return logs;
}

/// Functions of the angle from the axis that describe the darkening: 0 on the axis, 1 at a right angle.
Eigen::Vector2d shadingBasis(double angle) {
  const double square = 4.0 * angle * angle / (kAngleSteps * kAngleSteps);
  return {square, square * square};
}

}  // namespace

ExposureBalance::ExposureBalance(size_t num_cameras)
    : log_gains_(num_cameras, 0.0),
      gains_(num_cameras, 1.0),
      is_known_(num_cameras, 0),
      groups_(num_cameras * num_cameras * kNumAngleBins * kNumAngleBins) {}

double ExposureBalance::brightening(uint8_t angle) const {
  return std::exp(-std::clamp(shading_.dot(shadingBasis(angle)), -kMaxShading, kMaxShading));
}

std::vector<ExposureBalance::Ratio> ExposureBalance::medianRatios(const std::vector<GrayPair>& pairs) {
  static const std::array<float, 256> logs = makeLogTable();
  const size_t num_cameras = gains_.size();
  for (std::vector<GrayPair>& group : groups_) {
    group.clear();
  }
  const auto binOf = [](uint8_t angle) { return std::min<size_t>(kNumAngleBins - 1, angle / 20U); };
  for (const GrayPair& pair : pairs) {
    if (std::min(pair.first_gray, pair.second_gray) < kDarkest ||
        std::max(pair.first_gray, pair.second_gray) > kBrightest) {
      continue;
    }
    const GrayPair ordered = pair.first_camera < pair.second_camera
                                 ? pair
                                 : GrayPair{pair.second_camera, pair.first_camera, pair.second_gray,
                                            pair.first_gray,    pair.second_angle, pair.first_angle};
    const size_t cameras = ordered.first_camera * num_cameras + ordered.second_camera;
    groups_[(cameras * kNumAngleBins + binOf(ordered.first_angle)) * kNumAngleBins +
            binOf(ordered.second_angle)]
        .push_back(ordered);
  }
  std::vector<Ratio> medians;
  std::vector<float> log_ratios;
  for (const std::vector<GrayPair>& group : groups_) {
    if (group.size() < kMinPairs) {
      continue;
    }
    log_ratios.clear();
    Eigen::Vector2d basis = Eigen::Vector2d::Zero();
    for (const GrayPair& pair : group) {
      log_ratios.push_back(logs[pair.first_gray] - logs[pair.second_gray]);
      basis += shadingBasis(pair.first_angle) - shadingBasis(pair.second_angle);
    }
    const auto middle = log_ratios.begin() + static_cast<std::ptrdiff_t>(log_ratios.size() / 2);
    std::nth_element(log_ratios.begin(), middle, log_ratios.end());
    const auto count = static_cast<double>(group.size());
    medians.push_back({group.front().first_camera, group.front().second_camera, *middle,
                       std::min(1.0, count / kFullWeight), basis / count});
  }
  return medians;
}

Eigen::VectorXd ExposureBalance::solve(const std::vector<Ratio>& ratios) const {
  // Brightness in a camera: log(ground) - gain + shading. Unknowns: gains, shading.
  const auto n = static_cast<Eigen::Index>(gains_.size());
  Eigen::VectorXd solution(n + kNumShading), keep(n + kNumShading);
  solution << Eigen::Map<const Eigen::VectorXd>(log_gains_.data(), n), shading_;
  keep << Eigen::VectorXd::Constant(n, kKeep), Eigen::VectorXd::Constant(kNumShading, kKeepShading);
  Eigen::VectorXd prior = solution;
  prior.tail<kNumShading>().setZero();
  for (int iteration = 0; iteration < kNumIterations; ++iteration) {
    Eigen::MatrixXd normal = keep.asDiagonal();
    Eigen::VectorXd right = keep.cwiseProduct(prior);
    for (const Ratio& ratio : ratios) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(n + kNumShading);
      row[static_cast<Eigen::Index>(ratio.first)] = -1.0;
      row[static_cast<Eigen::Index>(ratio.second)] = 1.0;
      row.tail<kNumShading>() = ratio.shading;
      // The first solution takes all ratios as equally good: gains may be far from the last ones.
      const double residual = iteration == 0 ? 0.0 : std::abs(row.dot(solution) - ratio.log_ratio);
      const double weight = ratio.weight * std::min(1.0, kInlier / std::max(residual, 1e-9));
      normal += weight * row * row.transpose();
      right += weight * ratio.log_ratio * row;
    }
    solution = normal.ldlt().solve(right);
  }
  return solution;
}

void ExposureBalance::update(const std::vector<GrayPair>& pairs) {
  const std::vector<Ratio> ratios = medianRatios(pairs);
  if (ratios.empty()) {
    return;
  }
  const Eigen::VectorXd target = solve(ratios);
  const bool is_first = std::count(is_known_.begin(), is_known_.end(), 1) == 0;
  shading_ += (is_first ? 1.0 : kFollowShading) * (target.tail<kNumShading>() - shading_);
  std::vector<uint8_t> is_compared(gains_.size(), 0);
  for (const Ratio& ratio : ratios) {
    is_compared[ratio.first] = is_compared[ratio.second] = 1;
  }
  double sum = 0.0;
  int num_known = 0;
  for (size_t i = 0; i < gains_.size(); ++i) {
    if (is_compared[i] == 0 && is_known_[i] == 0) {
      continue;
    }
    const double difference = target[static_cast<Eigen::Index>(i)] - log_gains_[i];
    log_gains_[i] += difference * (is_known_[i] == 0              ? 1.0
                                   : std::abs(difference) > kStep ? kFollowStep
                                                                  : kFollow);
    is_known_[i] = 1;
    sum += log_gains_[i];
    ++num_known;
  }
  for (size_t i = 0; i < gains_.size(); ++i) {
    if (is_known_[i] != 0) {
      log_gains_[i] = std::clamp(log_gains_[i] - sum / num_known, -kMaxLogGain, kMaxLogGain);
      gains_[i] = std::exp(log_gains_[i]);
    }
  }
}

}  // namespace vcharge
