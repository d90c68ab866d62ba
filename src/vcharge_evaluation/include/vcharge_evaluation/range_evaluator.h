#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_evaluation/confidence_calibration.h"
#include "vcharge_evaluation/error_distribution.h"

namespace vcharge {

/// Options of RangeEvaluator.
struct RangeEvaluationOptions {
  VCHARGE_BEGIN_OPTIONS(RangeEvaluationOptions);
  VCHARGE_OPTION(int, pixel_step, 2, positive(), "Every how many columns and rows a pixel is judged.");
  VCHARGE_OPTION(double, max_truth_m, 20.0, above(0.5), "Largest true range that is judged.");
  VCHARGE_OPTION(double, tolerance, 0.05, positive(), "Relative error up to which a range is correct.");
  VCHARGE_OPTION(std::vector<double>, densities, (std::vector<double>{0.2, 0.4, 0.6, 0.8, 1.0}),
                 above(0.0).upTo(1.0), "Fractions of the pixels for which the accuracy is given.");
  VCHARGE_END_OPTIONS();
};

/// Accuracy of the most confident fraction of all judged pixels. An unknown range counts as wrong, so that
/// omitting pixels does not help.
struct RangeAccuracy {
  double density = 0.0;
  double fraction_within_tolerance = 0.0;
  double median_relative_error = 0.0;  ///< median over the known ranges among these pixels
  double fraction_known = 0.0;
};

/// Accuracy of the known ranges whose true range or confidence is in [low, high).
struct RangeBin {
  double low = 0.0;
  double high = 0.0;
  size_t num_judged = 0;  ///< pixels with and without a range
  size_t count = 0;       ///< pixels with a range
  double fraction_within_tolerance = 0.0;
  double median_relative_error = 0.0;
  double fraction_within_one_sigma = 0.0;
};

struct RangeErrors {
  size_t num_frames = 0;
  size_t num_judged = 0;  ///< pixels with texture, a true range in bounds, and off the direction of travel
  size_t num_known = 0;   ///< judged pixels with a range
  /// Relative errors of all judged pixels; unknown ranges and larger errors count as 0.5.
  ErrorDistribution bounded_relative_error;
  std::vector<RangeAccuracy> accuracy;
  double fraction_within_one_sigma =
      0.0;  ///< fraction of the known ranges; 0.683 for normal errors and a correct sigma
  double fraction_within_two_sigma = 0.0;
  std::vector<RangeBin> by_truth;
  std::vector<RangeBin> by_confidence;
  std::vector<ConfidenceBin> calibration;  ///< a range is right within 10 % of the truth
};

/// Compares range maps with their truth.
class RangeEvaluator {
 public:
  explicit RangeEvaluator(const RangeEvaluationOptions& options = RangeEvaluationOptions());

  /// image: CV_8UC1 of the working camera; truth_m: CV_32FC1, NaN without a surface; valid: CV_8UC1, 0 on the
  /// own vehicle. travel_direction_in_camera has any length and is absent while the vehicle stands, when all
  /// directions are judged. std::logic_error for other sizes or types.
  void add(const RangeMap& map, const cv::Mat& image, const cv::Mat& truth_m, const cv::Mat& valid,
           const std::optional<Eigen::Vector3d>& travel_direction_in_camera);

  RangeErrors errors() const;

 private:
  struct Sample {
    float truth_m;
    float range_m;  // NaN: unknown
    float sigma_m;
    float confidence;
  };
  struct Known;
  RangeBin makeBin(double low, double high, float Sample::*criterion) const;

  RangeEvaluationOptions options_;
  size_t num_frames_ = 0;
  std::vector<Sample> samples_;
};

}  // namespace vcharge
