#include "vcharge_dense/neighbour_selection.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

void NeighbourOptions::checkFields() const {
  requireField(max_forward_baseline_m >= max_baseline_m, "max_forward_baseline_m",
               "must not be below max_baseline_m", max_forward_baseline_m);
}

double longestBaseline(const NeighbourOptions& options, const Eigen::Vector3d& optical_axis,
                       const Eigen::Vector3d& travel_direction) {
  const double along = std::min(1.0, std::abs(optical_axis.dot(travel_direction)));
  return options.max_baseline_m + along * (options.max_forward_baseline_m - options.max_baseline_m);
}

std::vector<size_t> selectNeighbours(const std::vector<double>& baselines_m, int count, double longest_m) {
  std::vector<size_t> chosen;
  for (int k = count; k >= 1; --k) {
    const double target_m = longest_m * k / count;
    bool found = false;
    size_t best = 0;
    for (size_t i = 0; i < baselines_m.size(); ++i) {
      const bool usable = baselines_m[i] >= kMinBaseline_m && baselines_m[i] <= 1.25 * longest_m &&
                          std::find(chosen.begin(), chosen.end(), i) == chosen.end();
      if (usable &&
          (!found || std::abs(baselines_m[i] - target_m) < std::abs(baselines_m[best] - target_m))) {
        best = i;
        found = true;
      }
    }
    if (found) {
      chosen.push_back(best);
    }
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace vcharge
