#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace vcharge {

/// Summary of a set of errors; all zero if count is 0.
struct ErrorDistribution {
  size_t count = 0;
  double mean = 0.0;
  double root_mean_square = 0.0;
  double percentile_50 = 0.0;
  double percentile_68 = 0.0;
  double percentile_90 = 0.0;
  double percentile_95 = 0.0;
  double percentile_99 = 0.0;
  double max = 0.0;
};

/// Percentile p (0 to 100) of a sorted set, interpolated between ranks. std::logic_error for an empty set.
double percentileOfSorted(const std::vector<double>& sorted, double p);
ErrorDistribution summarize(std::vector<double> errors);
/// JSON with the members of ErrorDistribution as keys.
void to_json(nlohmann::json& json, const ErrorDistribution& distribution);

}  // namespace vcharge
