#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "vcharge_geometry/robust/match_sampler.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_geometry/solvers/rotation_translation.h"

namespace vcharge {

/// Best model found by estimateRobustly().
struct RobustResult {
  bool found = false;
  RotationTranslation model;
  std::vector<int> inliers;  ///< indices of matches, ascending
  double score = 0.0;        ///< sum over all matches of the squared error, at most max_error_rad^2 each
  int num_iterations = 0;
};

/// Number of samples after which one is free of outliers with the given confidence: ln(1 - confidence) / ln(1
/// - inlier_ratio^sample_size).
inline double iterationsForConfidence(double inlier_ratio, int sample_size, double confidence) {
  const double good_sample = std::pow(inlier_ratio, sample_size);
  if (good_sample >= 1.0) {
    return 1.0;
  }
  return good_sample <= 0.0 ? INFINITY : std::log1p(-confidence) / std::log1p(-good_sample);
}

/// Locally optimized RANSAC (Chum, Matas, Kittler, DAGM 2003; Lebeda, Matas, Chum, BMVC 2012) with truncated
/// squared errors (MSAC: Torr and Zisserman, CVIU 2000) and samples from MatchSampler; stops when the
/// confidence is reached. Deterministic. A Problem has
///   static constexpr int kSampleSize, of which there must be at least as many matches;
///   qualities() and groups(), vectors with an entry per match (see MatchSampler);
///   solve(sample, visit), which calls visit(RotationTranslation) for each solution of a sample of indices;
///   squaredError(model, match) in rad^2;
///   refined(model, truncation_rad, max_steps), a locally optimized model.
template <class Problem>
RobustResult estimateRobustly(const Problem& problem, const RobustOptions& options) {
  const int num_matches = static_cast<int>(problem.qualities().size());
  const double max_squared = options.max_error_rad * options.max_error_rad;
  MatchSampler sampler(problem.qualities(), problem.groups(), Problem::kSampleSize, options.order_by_quality,
                       options.max_iterations, options.seed);
  RobustResult best;
  best.score = INFINITY;
  int best_num_inliers = 0;
  // Score of a model; stops early when it exceeds the best score.
  const auto scoreOf = [&](const RotationTranslation& model, int* num_inliers) {
    double score = 0.0;
    *num_inliers = 0;
    for (int i = 0; i < num_matches && score < best.score; ++i) {
      const double squared = problem.squaredError(model, i);
      if (squared < max_squared) {
        score += squared;
        ++*num_inliers;
      } else {
        score += max_squared;
      }
    }
    return score;
  };
  const auto takeIfBetter = [&](const RotationTranslation& model) {
    int num_inliers = 0;
    const double score = scoreOf(model, &num_inliers);
    if (!(score < best.score)) {
      return false;
    }
    best.score = score;
    best.model = model;
    best_num_inliers = num_inliers;
    return true;
  };
  constexpr int kLocalSteps = 4;
  constexpr int kFinalSteps = 20;
  // Models from minimal samples are noisy. The wider truncation includes inliers that such a model misses.
  const auto refineBest = [&](int max_steps) {
    const RotationTranslation start = best.model;
    const RotationTranslation wide = problem.refined(start, 3.0 * options.max_error_rad, max_steps);
    takeIfBetter(problem.refined(wide, options.max_error_rad, max_steps));
    takeIfBetter(problem.refined(start, options.max_error_rad, max_steps));
  };
  // A few more samples protect against a first model with many inliers by chance.
  constexpr int kMinIterations = 10;
  double needed = options.max_iterations;
  while (best.num_iterations < options.max_iterations &&
         (best.num_iterations < kMinIterations || best.num_iterations < needed)) {
    ++best.num_iterations;
    std::array<int, static_cast<size_t>(Problem::kSampleSize)> sample;
    sampler.draw(sample.data());
    bool improved = false;
    problem.solve(sample,
                  [&](const RotationTranslation& model) { improved = takeIfBetter(model) || improved; });
    if (!improved) {
      continue;
    }
    if (options.refine_best_models && best_num_inliers > Problem::kSampleSize) {
      refineBest(kLocalSteps);
    }
    needed = iterationsForConfidence(static_cast<double>(best_num_inliers) / num_matches,
                                     Problem::kSampleSize, options.confidence);
  }
  if (options.refine_best_models && std::isfinite(best.score)) {
    refineBest(kFinalSteps);
  }
  for (int i = 0; i < num_matches && std::isfinite(best.score); ++i) {
    if (problem.squaredError(best.model, i) < max_squared) {
      best.inliers.push_back(i);
    }
  }
  best.found = static_cast<int>(best.inliers.size()) >= std::max(options.min_inliers, Problem::kSampleSize);
  return best;
}

}  // namespace vcharge
