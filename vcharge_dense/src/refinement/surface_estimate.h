#pragma once

#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep/tile_scorer.h"
#include "vcharge_dense/plane_family.h"

namespace vcharge {

/// What a sweep found per pixel, as inverse range along the ray. CV_32FC1 unless said otherwise.
struct SurfaceEstimate {
  explicit SurfaceEstimate(cv::Size size);

  cv::Mat inverse_range;  ///< NaN where no plane was scored
  cv::Mat step;           ///< distance of neighbouring hypotheses in inverse range
  cv::Mat score;
  cv::Mat
      curvature;  ///< negative second derivative of the score by inverse range at its peak; NaN where none
  cv::Mat second_score;  ///< of the next best separate peak, -1 where there is none
  cv::Mat plane;         ///< CV_32SC1: over all families, -1 where none
  cv::Mat voters;        ///< CV_32SC1: bit n for neighbour n
  cv::Mat at_limit;      ///< CV_8UC1: not 0 where the planes on both sides of the best one were not scored
};

struct Parabola {
  float offset = 0.0f;                                        ///< of the maximum, in hypotheses
  float curvature = std::numeric_limits<float>::quiet_NaN();  ///< negative second difference of correlations
};

/// Parabola through three scores whose middle one is the highest (Tian and Huhns 1986); scores as in
/// TileScores.
Parabola fitParabola(int before, int middle, int after);

/// The planes of a family as hypotheses: base 0, weight -normal . ray, NaN where a ray does not meet them.
Hypotheses makePlaneHypotheses(const PlaneFamily& family, const RayTable& rays, const cv::Mat& valid_mask,
                               int window_px);

/// Reads one tile's scores of all families into the estimate. A family beyond the first one only counts where
/// its best plane lies inside the planes that were scored: those beyond belong to the first one.
void readPeaks(const std::vector<Hypotheses>& hypotheses, const std::vector<TileScores>& scores,
               bool interpolate, SurfaceEstimate* estimate);

/// Hypotheses around the smoothed estimate, closely spaced (SweepInput's options); see PlaneSweepOptions.
Hypotheses makeRefinement(const SweepInput& input, const cv::Mat& window_counts,
                          const SurfaceEstimate& estimate);

/// Replaces the estimate of a tile where the refinement's scores have a peak; elsewhere the first sweep's
/// stays.
void readRefinement(const Hypotheses& refinement, const TileScores& scores, bool interpolate,
                    SurfaceEstimate* estimate);

}  // namespace vcharge
