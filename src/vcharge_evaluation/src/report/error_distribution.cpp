#include "vcharge_evaluation/error_distribution.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {

double percentileOfSorted(const std::vector<double>& sorted, double p) {
  check(!sorted.empty(), "percentileOfSorted: the set is empty");
  const double rank = std::clamp(p / 100.0, 0.0, 1.0) * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<size_t>(rank);
  const size_t high = std::min(low + 1, sorted.size() - 1);
  const double fraction = rank - static_cast<double>(low);
  return (1.0 - fraction) * sorted[low] + fraction * sorted[high];
}

ErrorDistribution summarize(std::vector<double> errors) {
  ErrorDistribution result;
  result.count = errors.size();
  if (errors.empty()) {
    return result;
  }
  std::sort(errors.begin(), errors.end());
  double sum = 0.0;
  double squares = 0.0;
  for (const double error : errors) {
    sum += error;
    squares += error * error;
  }
  const auto count = static_cast<double>(errors.size());
  result.mean = sum / count;
  result.root_mean_square = std::sqrt(squares / count);
  result.percentile_50 = percentileOfSorted(errors, 50.0);
  result.percentile_68 = percentileOfSorted(errors, 68.0);
  result.percentile_90 = percentileOfSorted(errors, 90.0);
  result.percentile_95 = percentileOfSorted(errors, 95.0);
  result.percentile_99 = percentileOfSorted(errors, 99.0);
  result.max = errors.back();
  return result;
}

void to_json(nlohmann::json& json, const ErrorDistribution& d) {
  json = {{"count", d.count},
          {"mean", d.mean},
          {"root_mean_square", d.root_mean_square},
          {"percentile_50", d.percentile_50},
          {"percentile_68", d.percentile_68},
          {"percentile_90", d.percentile_90},
          {"percentile_95", d.percentile_95},
          {"percentile_99", d.percentile_99},
          {"max", d.max}};
}

}  // namespace vcharge
