#include "vcharge_calibration/monitor/pitch_response.h"

#include <algorithm>
#include <optional>

#include <Eigen/Cholesky>

namespace vcharge {
namespace {

/// Over a longer time between keyframes the vehicle may have stood.
constexpr double kMaxPeriod_s = 1.0;
constexpr size_t kMinKeyframes = 8;
/// Least residual of a keyframe's pitch.
constexpr double kPitch_rad = 0.0005;
constexpr double kSoft_rad_per_m_per_s2 = 0.008;
constexpr double kCertain_sigmas = 3.0;

double noseUp(const Keyframe& keyframe) {
  return std::asin((keyframe.map_from_vehicle.rotation() * Eigen::Vector3d::UnitX()).z());
}

/// Forward acceleration around the middle one of three keyframes; nothing if the vehicle may have stood.
std::optional<double> accelerationAt(const Keyframe& before, const Keyframe& middle, const Keyframe& after) {
  const double first_s = toSeconds(middle.stamp - before.stamp),
               second_s = toSeconds(after.stamp - middle.stamp);
  if (!(first_s > 0.0 && second_s > 0.0 && first_s <= kMaxPeriod_s && second_s <= kMaxPeriod_s)) {
    return std::nullopt;
  }
  const auto forward_m = [](const Keyframe& from, const Keyframe& to) {
    return (from.map_from_vehicle.inverse() * to.map_from_vehicle).translation().x();
  };
  return 2.0 * (forward_m(middle, after) / second_s - forward_m(before, middle) / first_s) /
         (first_s + second_s);
}

}  // namespace

void PitchResponse::add(const std::vector<Keyframe>& keyframes) {
  std::vector<Eigen::Vector3d> causes;  // constant, distance, acceleration
  std::vector<double> pitch_rad;
  for (size_t i = 1; i + 1 < keyframes.size(); ++i) {
    if (const auto acceleration = accelerationAt(keyframes[i - 1], keyframes[i], keyframes[i + 1])) {
      causes.emplace_back(1.0, keyframes[i].travelled_m - keyframes.front().travelled_m, *acceleration);
      pitch_rad.push_back(noseUp(keyframes[i]));
    }
  }
  if (causes.size() < kMinKeyframes) {
    return;
  }
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d products = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < causes.size(); ++i) {
    squares += causes[i] * causes[i].transpose();
    products += causes[i] * pitch_rad[i];
  }
  const Eigen::LDLT<Eigen::Matrix3d> normal(squares);
  const Eigen::Vector3d effects = normal.solve(products);
  const double variance_of_one = normal.solve(Eigen::Vector3d::UnitZ().eval()).z();
  double residual_rad2 = 0.0;
  for (size_t i = 0; i < causes.size(); ++i) {
    residual_rad2 += std::pow(pitch_rad[i] - causes[i].dot(effects), 2);
  }
  const double variance_rad2 =
      std::max(kPitch_rad * kPitch_rad, residual_rad2 / static_cast<double>(causes.size() - 3));
  if (variance_of_one > 0.0 && effects.allFinite()) {
    information_ += 1.0 / (variance_rad2 * variance_of_one);
    vector_ += effects.z() / (variance_rad2 * variance_of_one);
  }
}

PitchResponse& PitchResponse::operator+=(const PitchResponse& other) {
  information_ += other.information_;
  vector_ += other.vector_;
  return *this;
}

bool PitchResponse::isSoft() const {
  return radPerMetrePerS2() - kCertain_sigmas * sigma() > kSoft_rad_per_m_per_s2;
}

}  // namespace vcharge
