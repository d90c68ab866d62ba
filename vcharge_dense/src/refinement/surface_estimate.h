#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep/tile_scorer.h"
#include "vcharge_dense/plane_family.h"

namespace vcharge {

/// Surface that a sweep found, per pixel, as inverse range along the ray. CV_32FC1 unless stated otherwise.
struct SurfaceEstimate {
  explicit SurfaceEstimate(cv::Size size);

  cv::Mat inverse_range;  ///< NaN where no plane was scored
  cv::Mat step;           ///< spacing of neighbouring hypotheses in inverse range
  cv::Mat score;
  cv::Mat curvature;     ///< negative second derivative of the score at its peak; NaN where unknown
  cv::Mat second_score;  ///< score of the next best separate peak, -1 if there is none
  cv::Mat plane;         ///< CV_32SC1: best plane, counted over all families; -1 where none
  cv::Mat voters;        ///< CV_32SC1: bit n: neighbour n contributed
  cv::Mat at_limit;      ///< CV_8UC1: not 0 if a plane beside the best one was not scored
};

constexpr float kPerScore = 1.0f / kScoreScale;

struct Parabola {
  float offset = 0.0f;  ///< offset of the maximum from the middle, in hypotheses
  float curvature = std::numeric_limits<float>::quiet_NaN();  ///< negative second difference of correlations
};

/// Parabola through three scores (as in TileScores), the middle one being the highest (Tian and Huhns 1986).
inline Parabola fitParabola(int before, int middle, int after) {
  Parabola parabola;
  const int curvature = 2 * middle - before - after;
  if (curvature > 0) {
    const auto scaled = static_cast<float>(curvature);
    parabola.curvature = kPerScore * scaled;
    parabola.offset = std::clamp(0.5f * static_cast<float>(after - before) / scaled, -0.5f, 0.5f);
  }
  return parabola;
}

/// The planes of a family as hypotheses: base 0, weight -normal . ray, NaN if the ray does not meet them.
Hypotheses makePlaneHypotheses(const PlaneFamily& family, const RayTable& rays, const cv::Mat& valid_mask);

/// Reads one tile's scores of all families into the estimate. Families after the first are only used where
/// their best plane is not their outermost scored one: surfaces beyond it belong to the first family.
void readPeaks(const std::vector<Hypotheses>& hypotheses, const std::vector<TileScores>& scores,
               SurfaceEstimate* estimate);

/// Closely spaced hypotheses around the smoothed estimate, see PlaneSweepOptions::num_refinement_steps.
Hypotheses makeRefinement(const SweepInput& input, const cv::Mat& window_counts,
                          const SurfaceEstimate& estimate);

/// Replaces the estimate of a tile where the refinement's scores have a peak.
void readRefinement(const Hypotheses& refinement, const TileScores& scores, SurfaceEstimate* estimate);

}  // namespace vcharge
