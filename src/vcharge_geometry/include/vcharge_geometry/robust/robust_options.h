#pragma once

namespace vcharge {

/// Options of the robust estimators. Errors are angles of viewing rays.
struct RobustOptions {
  double max_error_rad = 0.005;  ///< a match with a larger error is an outlier; about 3 standard deviations
  double confidence = 0.99;      ///< wanted probability of one sample without outliers
  int min_iterations = 10;
  int max_iterations = 2000;
  int min_inliers = 10;            ///< fewer mean that there is no consensus
  bool order_by_quality = true;    ///< draw from the best matches first (PROSAC)
  bool refine_best_models = true;  ///< local optimization within the loop (LO-RANSAC)
  /// A translation whose length has a larger standard deviation, relative to it, is reported as a direction
  /// only.
  double max_relative_scale_deviation = 0.5;
  int seed = 1;  ///< same seed, same matches: same result

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_error_rad", max_error_rad);
    visit("confidence", confidence);
    visit("min_iterations", min_iterations);
    visit("max_iterations", max_iterations);
    visit("min_inliers", min_inliers);
    visit("order_by_quality", order_by_quality);
    visit("refine_best_models", refine_best_models);
    visit("max_relative_scale_deviation", max_relative_scale_deviation);
    visit("seed", seed);
  }
  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// Status of a robust estimation. Results are valid for kOk and, in part, for kScaleUnobservable.
enum class EstimationStatus {
  kOk,
  kScaleUnobservable,  ///< rotation and direction of the translation are known, but not its length
  kTooFewMatches,      ///< fewer than a minimal sample
  kNotFinite,          ///< NaN or infinity in a match, or a ray without a direction
  kNoConsensus,        ///< no model has min_inliers inliers
};

}  // namespace vcharge
