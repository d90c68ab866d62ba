#include "monitor/camera_sight.h"

#include <algorithm>

#include "vcharge_calibration/monitor/rig_monitor.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr size_t kMinParts = 2;
constexpr size_t kMaxParts = 50;
/// Where all cameras see nearly nothing, they cannot be compared.
constexpr double kMinCommon = 0.05;

}  // namespace

std::vector<double> CameraSight::add(const std::vector<int64_t>& num_observations, double length_m) {
  std::vector<double> sight(usual_.size(), 1.0);
  if (length_m <= 0.0) {
    return sight;
  }
  if (usual_.front().size() >= kMinParts) {
    for (size_t i = 0; i < usual_.size(); ++i) {
      sight[i] =
          static_cast<double>(num_observations[i]) / length_m / std::max(1.0, quantile(usual_[i], 0.5));
    }
    const double common = quantile(sight, 0.5);
    for (double& each : sight) {
      each = common > kMinCommon ? each / common : 1.0;
    }
  }
  // What is seen through a dirty lens does not become usual.
  const bool is_usual = *std::min_element(sight.begin(), sight.end()) >= kMinSight;
  for (size_t i = 0; i < usual_.size() && is_usual; ++i) {
    usual_[i].push_back(static_cast<double>(num_observations[i]) / length_m);
    if (usual_[i].size() > kMaxParts) {
      usual_[i].erase(usual_[i].begin());
    }
  }
  return sight;
}

}  // namespace vcharge
