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
// Level of dark images over the usual one, and over that of the brightest camera at the time: cameras with
// automatic exposure are equally bright, unless it is too dark.
constexpr double kDark = 0.7;
constexpr double kDarkAmongOthers = 0.6;

}  // namespace

std::vector<double> CameraSight::add(const std::vector<Seen>& seen, double length_m) {
  std::vector<double> sight(usual_.size(), 1.0);
  if (length_m <= 0.0) {
    return sight;
  }
  std::vector<bool> is_dark(usual_.size(), false);
  const auto perMetre = [&](size_t i) { return static_cast<double>(seen[i].num_observations) / length_m; };
  const double brightest = std::max_element(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
                             return a.level < b.level;
                           })->level;
  for (size_t i = 0; i < usual_.size(); ++i) {
    is_dark[i] = seen[i].level < kDarkAmongOthers * brightest;
  }
  if (usual_.front().levels.size() >= kMinParts) {
    for (size_t i = 0; i < usual_.size(); ++i) {
      sight[i] = perMetre(i) / std::max(1.0, quantile(usual_[i].per_metre, 0.5));
      is_dark[i] = is_dark[i] || seen[i].level < kDark * quantile(usual_[i].levels, 0.5);
    }
    const double common = quantile(sight, 0.5);
    for (size_t i = 0; i < usual_.size(); ++i) {
      sight[i] = is_dark[i] || common <= kMinCommon ? 1.0 : sight[i] / common;
    }
  }
  // Neither darkness nor what is seen through a dirty lens becomes usual.
  const bool is_usual = *std::min_element(sight.begin(), sight.end()) >= kMinSight &&
                        std::find(is_dark.begin(), is_dark.end(), true) == is_dark.end();
  for (size_t i = 0; i < usual_.size() && is_usual; ++i) {
    usual_[i].per_metre.push_back(perMetre(i));
    usual_[i].levels.push_back(seen[i].level);
    if (usual_[i].levels.size() > kMaxParts) {
      usual_[i].per_metre.erase(usual_[i].per_metre.begin());
      usual_[i].levels.erase(usual_[i].levels.begin());
    }
  }
  return sight;
}

}  // namespace vcharge
