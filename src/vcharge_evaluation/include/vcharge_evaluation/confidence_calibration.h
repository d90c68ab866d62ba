#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace vcharge {

/// Results with a reported confidence in one interval. With a calibrated confidence the two ratios are equal.
struct ConfidenceBin {
  size_t count = 0;
  double mean_confidence = 0.0;
  double fraction_right = 0.0;
};

/// Compares reported confidences (0 to 1) with how often the results were right, in ten equal intervals.
class ConfidenceCalibration {
 public:
  static constexpr size_t kNumBins = 10;

  /// A confidence outside [0, 1] counts as the nearer bound, one that is not a number as 0.
  void add(double confidence, bool is_right);
  /// Bins in rising order of confidence, without empty ones.
  std::vector<ConfidenceBin> bins() const;

 private:
  struct Sums {
    size_t count = 0, right = 0;
    double confidence = 0.0;
  };
  std::array<Sums, kNumBins> sums_;
};

/// Mean distance of confidence and fraction of right results, weighted by count: the expected calibration
/// error (Guo et al., "On calibration of modern neural networks", ICML 2017, equation 5); 0 without results.
double expectedCalibrationError(const std::vector<ConfidenceBin>& bins);

/// Probability that a normal error with this standard deviation stays within a bound.
double probabilityWithin(double bound, double standard_deviation);

/// JSON with expected_calibration_error and bins [{count, mean_confidence, fraction_right}].
nlohmann::json calibrationToJson(const std::vector<ConfidenceBin>& bins);

}  // namespace vcharge
