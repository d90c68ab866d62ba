#include "surface_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "parallel_rows.h"
#include "range_uncertainty.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Parabola {
  float offset = 0.0f;     ///< of the maximum, in hypotheses
  float curvature = kNaN;  ///< negative second difference
  float rise = 0.0f;       ///< of the maximum over the middle score
};

/// Parabola through three scores whose middle one is the highest (Tian and Huhns 1986).
Parabola fitParabola(float before, float middle, float after) {
  Parabola parabola;
  const float curvature = 2.0f * middle - before - after;
  if (curvature > 1e-6f) {
    parabola.curvature = curvature;
    parabola.offset = std::clamp(0.5f * (after - before) / curvature, -0.5f, 0.5f);
    parabola.rise = 0.125f * (after - before) * (after - before) / curvature;
  }
  return parabola;
}

float correlation(int16_t score) {
  return score == kNoScore ? kNaN : static_cast<float>(score) / kScoreScale;
}

/// Calls function(x, y, pixel of the layout) for the pixels of a tile.
template <class Function>
void forEachPixel(const TileScores& scores, const Function& function) {
  for (int row = 0; row < scores.tile.height; ++row) {
    for (int column = 0; column < scores.tile.width; ++column) {
      function(scores.tile.x + column, scores.tile.y + row, scores.layout.index(row, column));
    }
  }
}

float offsetOf(const Hypotheses& hypotheses, const TileScores& scores, int slot) {
  return hypotheses.offsets[static_cast<size_t>(scores.slots[static_cast<size_t>(slot)])];
}

/// Score of a family's best peak that lies further than `separation` from `inverse_range`, of its two highest
/// ones; -1 where there is none.
float bestPeakApart(const Hypotheses& hypotheses, const TileScores& scores, size_t pixel, float weight,
                    float inverse_range, float separation) {
  const int16_t indices[] = {scores.best[pixel], scores.second[pixel]};
  const int16_t values[] = {scores.best_score[pixel], scores.second_score[pixel]};
  for (int i = 0; i < 2; ++i) {
    if (indices[i] >= 0 &&
        std::abs(offsetOf(hypotheses, scores, indices[i]) * weight - inverse_range) > separation) {
      return correlation(values[i]);
    }
  }
  return -1.0f;
}

/// Mean over a square of those values that are not NaN; NaN where there is none.
cv::Mat meanOfKnown(const cv::Mat& values, int side) {
  cv::Mat known = values == values;  // NaN differs from itself
  cv::Mat filled = values.clone(), weights, sum, weight_sum;
  filled.setTo(0.0f, ~known);
  known.convertTo(weights, CV_32F, 1.0 / 255.0);
  cv::boxFilter(filled, sum, CV_32F, cv::Size(side, side), cv::Point(-1, -1), false, cv::BORDER_CONSTANT);
  cv::boxFilter(weights, weight_sum, CV_32F, cv::Size(side, side), cv::Point(-1, -1), false,
                cv::BORDER_CONSTANT);
  cv::Mat mean(values.size(), CV_32FC1, cv::Scalar(kNaN));
  forEachRow(mean.rows, [&](int y) {
    for (int x = 0; x < mean.cols; ++x) {
      const float weight = weight_sum.at<float>(y, x);
      if (weight > 0.5f) {
        mean.at<float>(y, x) = sum.at<float>(y, x) / weight;
      }
    }
  });
  return mean;
}

/// Fills unknown values from ever larger neighbourhoods.
cv::Mat fillUnknown(const cv::Mat& values) {
  cv::Mat filled = values.clone();
  for (int side = 5; side < 2 * std::max(values.cols, values.rows); side *= 3) {
    const cv::Mat unknown = filled != filled;
    if (cv::countNonZero(unknown) == 0) {
      break;
    }
    meanOfKnown(filled, side | 1).copyTo(filled, unknown);
  }
  return filled;
}

/// The surface without outliers and plane steps: median, then the mean of those neighbours that lie within
/// one step.
cv::Mat smoothSurface(const SweepKernels& kernels, const SurfaceEstimate& estimate) {
  constexpr int kRadius = 4, kStep = 2;
  cv::Mat median, padded;
  cv::medianBlur(fillUnknown(estimate.inverse_range), median, 5);
  cv::copyMakeBorder(median, padded, 0, 0, kRadius, kRadius, cv::BORDER_CONSTANT, cv::Scalar(kNaN));
  cv::Mat smooth = median.clone();
  forEachRow(smooth.rows, [&](int y) {
    std::vector<const float*> rows;
    for (int v = std::max(0, y - kRadius); v <= std::min(smooth.rows - 1, y + kRadius); v += kStep) {
      rows.push_back(padded.ptr<float>(v) + kRadius);
    }
    const auto columns = static_cast<size_t>(smooth.cols);
    std::vector<float> number(columns), sum(columns);
    kernels.sumAgreeing({columns, rows.data(), static_cast<int>(rows.size()), kRadius, kStep,
                         median.ptr<float>(y), estimate.step.ptr<float>(y)},
                        number.data(), sum.data());
    auto* row = smooth.ptr<float>(y);
    for (size_t x = 0; x < columns; ++x) {
      row[x] = number[x] > 0.0f ? sum[x] / number[x] : row[x];
    }
  });
  return smooth;
}

}  // namespace

SurfaceEstimate::SurfaceEstimate(cv::Size size)
    : inverse_range(size, CV_32FC1, cv::Scalar(kNaN)),
      step(size, CV_32FC1, cv::Scalar(kNaN)),
      score(size, CV_32FC1, cv::Scalar(kNaN)),
      curvature(size, CV_32FC1, cv::Scalar(kNaN)),
      second_score(size, CV_32FC1, cv::Scalar(-1.0f)),
      plane(size, CV_32SC1, cv::Scalar(-1)),
      voters(size, CV_32SC1, cv::Scalar(0)),
      at_limit(size, CV_8UC1, cv::Scalar(0)) {}

Hypotheses makePlaneHypotheses(const PlaneFamily& family, const RayTable& rays, const cv::Mat& valid_mask,
                               int window_px) {
  Hypotheses hypotheses;
  hypotheses.are_planes = true;
  hypotheses.normal = family.normal.cast<float>();
  hypotheses.weight = cv::Mat(rays.size(), CV_32FC1);
  hypotheses.offsets = family.inverse_distances_per_m;
  cv::Mat counts(rays.size(), CV_8UC1);
  for (int y = 0; y < rays.size().height; ++y) {
    for (int x = 0; x < rays.size().width; ++x) {
      const float weight = -hypotheses.normal.dot(rays.ray(x, y));
      const bool meets = weight > 1e-3f;
      hypotheses.weight.at<float>(y, x) = meets ? weight : kNaN;
      counts.at<uint8_t>(y, x) = meets && valid_mask.at<uint8_t>(y, x) != 0 ? 255 : 0;
    }
  }
  hypotheses.window_counts = windowsInside(counts, window_px);
  return hypotheses;
}

void readPeaks(const std::vector<Hypotheses>& hypotheses, const std::vector<TileScores>& scores,
               bool interpolate, SurfaceEstimate* estimate) {
  forEachPixel(scores.front(), [&](int x, int y, size_t pixel) {
    int family = -1;
    int16_t best_score = kNoScore;
    for (size_t f = 0; f < hypotheses.size(); ++f) {
      const int best = scores[f].best[pixel];
      if (best < 0 || (f > 0 && !scores[f].isInside(best))) {
        continue;
      }
      if (scores[f].best_score[pixel] > best_score) {
        best_score = scores[f].best_score[pixel];
        family = static_cast<int>(f);
      }
    }
    if (family < 0) {
      return;
    }
    const auto f = static_cast<size_t>(family);
    const Hypotheses& planes = hypotheses[f];
    const int best = scores[f].best[pixel];
    const float weight = planes.weight.at<float>(y, x);
    const float step = (planes.offsets[1] - planes.offsets[0]) * weight;
    const bool at_limit = !scores[f].isInside(best);
    Parabola parabola;
    if (!at_limit) {
      parabola = fitParabola(correlation(scores[f].before[pixel]), correlation(best_score),
                             correlation(scores[f].after[pixel]));
    }
    const float inverse_range = offsetOf(planes, scores[f], best) * weight;
    int plane = scores[f].slots[static_cast<size_t>(best)];
    float second = scores[f].second[pixel] >= 0 ? correlation(scores[f].second_score[pixel]) : -1.0f;
    for (size_t g = 0; g < hypotheses.size(); ++g) {
      if (g < f) {
        plane += static_cast<int>(hypotheses[g].offsets.size());
      }
      if (g != f) {
        const float other = bestPeakApart(hypotheses[g], scores[g], pixel,
                                          hypotheses[g].weight.at<float>(y, x), inverse_range, 2.0f * step);
        second = std::max(second, other);
      }
    }
    estimate->inverse_range.at<float>(y, x) = inverse_range + (interpolate ? parabola.offset * step : 0.0f);
    estimate->step.at<float>(y, x) = step;
    estimate->score.at<float>(y, x) = correlation(best_score);
    estimate->curvature.at<float>(y, x) = parabola.curvature / (step * step);
    estimate->second_score.at<float>(y, x) = second;
    estimate->plane.at<int>(y, x) = plane;
    estimate->voters.at<int>(y, x) = static_cast<int>(scores[f].voters(best, pixel));
    estimate->at_limit.at<uint8_t>(y, x) = at_limit ? 255 : 0;
  });
}

Hypotheses makeRefinement(const SweepInput& input, const cv::Mat& window_counts,
                          const SurfaceEstimate& estimate) {
  const int half = input.options->num_refinement_steps / 2;
  Hypotheses refinement;
  refinement.window_counts = window_counts;
  refinement.base = smoothSurface(input.kernels, estimate);
  refinement.weight = cv::Mat(refinement.base.size(), CV_32FC1, cv::Scalar(kNaN));
  for (int k = -half; k <= half; ++k) {
    refinement.offsets.push_back(static_cast<float>(k));
  }
  const cv::Mat step = fillUnknown(estimate.step);
  const std::vector<NeighbourUncertainty> neighbours = neighbourUncertainties(input);
  forEachRow(step.rows, [&](int y) {
    std::vector<float> motion(static_cast<size_t>(step.cols));
    input.kernels.largestMotion(uncertaintyRow(input, neighbours, refinement.base, y), motion.data());
    const auto* coarse_row = step.ptr<float>(y);
    auto* weight_row = refinement.weight.ptr<float>(y);
    for (int x = 0; x < step.cols; ++x) {
      const float fine = static_cast<float>(input.options->refinement_step_px) /
                         std::max(motion[static_cast<size_t>(x)], 1e-6f);
      // Fine enough for the neighbour that moves most, wide enough to reach half way to the next plane and
      // back.
      const float coarse = coarse_row[x] / static_cast<float>(half);
      weight_row[x] = std::clamp(fine, 0.75f * coarse, 2.0f * coarse);
    }
  });
  return refinement;
}

void readRefinement(const Hypotheses& refinement, const TileScores& scores, bool interpolate,
                    SurfaceEstimate* estimate) {
  const int last = static_cast<int>(refinement.offsets.size()) - 1;
  forEachPixel(scores, [&](int x, int y, size_t pixel) {
    const int best = scores.best[pixel];
    if (best <= 0 || best == last) {
      return;
    }
    const float best_score = correlation(scores.best_score[pixel]);
    const float weight = refinement.weight.at<float>(y, x);
    const float peak =
        refinement.base.at<float>(y, x) + refinement.offsets[static_cast<size_t>(best)] * weight;
    float& inverse_range = estimate->inverse_range.at<float>(y, x);
    float& step = estimate->step.at<float>(y, x);
    float& score = estimate->score.at<float>(y, x);
    // The first sweep's winner is another peak when the refinement ended far from it and scores less.
    if (best_score < score && std::abs(peak - inverse_range) > step) {
      return;
    }
    const Parabola parabola =
        fitParabola(correlation(scores.before[pixel]), best_score, correlation(scores.after[pixel]));
    inverse_range = peak + (interpolate ? parabola.offset * weight : 0.0f);
    step = weight;
    score = best_score;
    estimate->curvature.at<float>(y, x) = parabola.curvature / (weight * weight);
    estimate->voters.at<int>(y, x) = static_cast<int>(scores.voters(best, pixel));
    estimate->at_limit.at<uint8_t>(y, x) = 0;
  });
}

}  // namespace vcharge
