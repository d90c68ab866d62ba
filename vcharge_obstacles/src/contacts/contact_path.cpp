#include "contacts/contact_path.h"

#include <algorithm>

namespace vcharge {
namespace {

constexpr double kHistory_s = 1.2;
// Least number of contacts, and least time between the first and the last.
constexpr size_t kMinContacts = 7;
constexpr double kMinTime_s = 0.55;
// Ratio of what the motion explains of the scatter, per parameter, to what is left, per degree of freedom.
// Errors of successive contacts are alike, therefore it is several times the 99.9 % of independent ones.
constexpr double kMinRatio = 20.0;
constexpr double kMinTravel_m = 0.4;
constexpr double kLeastVariance_m2 = 1e-6;

}  // namespace

void ContactPath::forgetBefore(Timestamp stamp) {
  positions_.erase(std::remove_if(positions_.begin(), positions_.end(),
                                  [&](const auto& old) { return toSeconds(stamp - old.first) > kHistory_s; }),
                   positions_.end());
}

std::optional<Eigen::Vector2d> ContactPath::velocity() const {
  if (positions_.size() < kMinContacts ||
      toSeconds(positions_.back().first - positions_.front().first) < kMinTime_s) {
    return std::nullopt;
  }
  const Timestamp first = positions_.front().first;
  const auto count = static_cast<double>(positions_.size());
  double mean_s = 0.0;
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (const auto& [stamp, position_m] : positions_) {
    mean_s += toSeconds(stamp - first) / count;
    mean_m += position_m / count;
  }
  double times = 0.0, scatter = 0.0;
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  for (const auto& [stamp, position_m] : positions_) {
    const double time_s = toSeconds(stamp - first) - mean_s;
    times += time_s * time_s;
    product += time_s * (position_m - mean_m);
    scatter += (position_m - mean_m).squaredNorm();
  }
  const Eigen::Vector2d velocity = product / times;
  const double explained = times * velocity.squaredNorm();
  const double variance = std::max(0.0, scatter - explained) / (2.0 * count - 4.0) + kLeastVariance_m2;
  const double travel_m = velocity.norm() * toSeconds(positions_.back().first - first);
  if (explained / 2.0 < kMinRatio * variance || travel_m < kMinTravel_m) {
    return std::nullopt;
  }
  return velocity;
}

}  // namespace vcharge
