#pragma once

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Options of the robust estimators. Errors are angles of viewing rays.
struct RobustOptions {
  VCHARGE_BEGIN_OPTIONS(RobustOptions);
  VCHARGE_OPTION(double, max_error_rad, 0.005, above(0.0).below(0.5),
                 "Error beyond which a match is an outlier, about 3 standard deviations.");
  VCHARGE_OPTION(double, confidence, 0.99, above(0.0).below(1.0),
                 "Probability that at least one sample is free of outliers.");
  VCHARGE_OPTION(int, max_iterations, 2000, atLeast(1), "Largest number of samples.");
  VCHARGE_OPTION(int, min_inliers, 10, atLeast(1), "Number of inliers below which there is no consensus.");
  VCHARGE_OPTION(bool, order_by_quality, true, anyValue(),
                 "Whether the best matches are sampled first (PROSAC).");
  VCHARGE_OPTION(bool, refine_best_models, true, anyValue(),
                 "Whether the best models are optimized locally (LO-RANSAC).");
  VCHARGE_OPTION(int, seed, 1, anyValue(), "Seed of the random samples.");
  VCHARGE_END_OPTIONS();
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
