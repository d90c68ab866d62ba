#include "vcharge_evaluation/confidence_calibration.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

namespace vcharge {

void ConfidenceCalibration::add(double confidence, bool is_right) {
  const double bounded = confidence >= 0.0 ? std::min(confidence, 1.0) : 0.0;
  const auto bin = std::min(static_cast<size_t>(bounded * kNumBins), kNumBins - 1);
  ++sums_[bin].count;
  sums_[bin].right += is_right ? 1 : 0;
  sums_[bin].confidence += bounded;
}

std::vector<ConfidenceBin> ConfidenceCalibration::bins() const {
  std::vector<ConfidenceBin> bins;
  for (const Sums& sums : sums_) {
    if (sums.count > 0) {
      const auto count = static_cast<double>(sums.count);
      bins.push_back({sums.count, sums.confidence / count, static_cast<double>(sums.right) / count});
    }
  }
  return bins;
}

double expectedCalibrationError(const std::vector<ConfidenceBin>& bins) {
  double sum = 0.0, count = 0.0;
  for (const ConfidenceBin& bin : bins) {
    sum += static_cast<double>(bin.count) * std::abs(bin.mean_confidence - bin.fraction_right);
    count += static_cast<double>(bin.count);
  }
  return count > 0.0 ? sum / count : 0.0;
}

double probabilityWithin(double bound, double standard_deviation) {
  return standard_deviation > 0.0 ? std::erf(bound / (std::sqrt(2.0) * standard_deviation)) : 0.0;
}

nlohmann::json calibrationToJson(const std::vector<ConfidenceBin>& bins) {
  nlohmann::json list = nlohmann::json::array();
  for (const ConfidenceBin& bin : bins) {
    list.push_back({{"count", bin.count},
                    {"mean_confidence", bin.mean_confidence},
                    {"fraction_right", bin.fraction_right}});
  }
  return {{"expected_calibration_error", expectedCalibrationError(bins)}, {"bins", list}};
}

}  // namespace vcharge
