#include "refinement/surface_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"
#include "refinement/range_uncertainty.h"
#include "refinement/surface_smoothing.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Step of the refinement in the neighbour that moves most: samples the peak of the score finely for every
// baseline.
constexpr float kRefinementStep_px = 0.5f;

/// Reads a tile's scores pixel by pixel along its rows, although the layout interleaves pixels.
class RowReader {
 public:
  RowReader(const Hypotheses& hypotheses, const TileScores& scores, int first_plane)
      : hypotheses_(hypotheses), scores_(scores), first_plane_(first_plane) {
    for (size_t slot = 0; slot < scores.slots.size(); ++slot) {
      const int hypothesis = scores.slots[slot];
      const bool is_gap = hypothesis == kGap;
      offsets_.push_back(is_gap ? kNaN : hypotheses.offsets[static_cast<size_t>(hypothesis)]);
      steps_.push_back(is_gap ? kNaN : hypotheses.stepAt(static_cast<size_t>(hypothesis)));
      inside_.push_back(scores.isInside(static_cast<int>(slot)) ? 1 : 0);
    }
  }

  void setRow(int row) {
    row_ = static_cast<size_t>(row);
    const size_t first = row_ * scores_.layout.rowSize();
    best_ = scores_.best.data() + first;
    score_ = scores_.best_score.data() + first;
    before_ = scores_.before.data() + first;
    after_ = scores_.after.data() + first;
    second_ = scores_.second.data() + first;
    second_score_ = scores_.second_score.data() + first;
    weight_ = hypotheses_.weight.ptr<float>(scores_.tile.y + row) + scores_.tile.x;
  }
  // `pixel`: index in the layout's row.
  int best(size_t pixel) const { return best_[pixel]; }
  int score(size_t pixel) const { return score_[pixel]; }
  Parabola parabola(size_t pixel) const { return fitParabola(before_[pixel], score_[pixel], after_[pixel]); }
  float secondScore(size_t pixel) const {
    return second_[pixel] >= 0 ? kPerScore * static_cast<float>(second_score_[pixel]) : -1.0f;
  }
  uint32_t voters(int slot, size_t pixel) const { return scores_.voters(slot, row_, pixel); }

  float weight(int column) const { return weight_[column]; }
  float offset(int slot) const { return offsets_[static_cast<size_t>(slot)]; }
  float step(int slot) const { return steps_[static_cast<size_t>(slot)]; }
  bool isInside(int slot) const { return inside_[static_cast<size_t>(slot)] != 0; }
  int plane(int slot) const { return first_plane_ + scores_.slots[static_cast<size_t>(slot)]; }

  /// Score of the higher one of the two best peaks that is further than `separation` from `inverse_range`; -1
  /// if neither is.
  float bestPeakApart(size_t pixel, int column, float inverse_range, float separation) const {
    const auto is_apart = [&](int slot) {
      return slot >= 0 && std::abs(offset(slot) * weight(column) - inverse_range) > separation;
    };
    if (is_apart(best(pixel))) {
      return kPerScore * static_cast<float>(score(pixel));
    }
    return is_apart(second_[pixel]) ? secondScore(pixel) : -1.0f;
  }

 private:
  const Hypotheses& hypotheses_;
  const TileScores& scores_;
  const int first_plane_;
  std::vector<float> offsets_, steps_;  // indexed by slot
  std::vector<uint8_t> inside_;
  size_t row_ = 0;
  const int16_t *best_ = nullptr, *score_ = nullptr, *before_ = nullptr, *after_ = nullptr;
  const int16_t *second_ = nullptr, *second_score_ = nullptr;
  const float* weight_ = nullptr;
};

/// Index in the layout's row of each column of a tile.
std::vector<size_t> layoutIndices(const TileScores& scores) {
  std::vector<size_t> indices(static_cast<size_t>(scores.tile.width));
  for (int column = 0; column < scores.tile.width; ++column) {
    indices[static_cast<size_t>(column)] = scores.layout.index(0, column);
  }
  return indices;
}

/// The rows of an estimate that start at a tile's column.
struct EstimateRow {
  float *inverse_range, *step, *score, *curvature, *second_score;
  int *plane, *voters;
  uint8_t* at_limit;

  EstimateRow(SurfaceEstimate* estimate, int x, int y)
      : inverse_range(estimate->inverse_range.ptr<float>(y) + x),
        step(estimate->step.ptr<float>(y) + x),
        score(estimate->score.ptr<float>(y) + x),
        curvature(estimate->curvature.ptr<float>(y) + x),
        second_score(estimate->second_score.ptr<float>(y) + x),
        plane(estimate->plane.ptr<int>(y) + x),
        voters(estimate->voters.ptr<int>(y) + x),
        at_limit(estimate->at_limit.ptr<uint8_t>(y) + x) {}
};

}  // namespace

SurfaceEstimate::SurfaceEstimate(cv::Size size)
    : inverse_range(pooledMat(size, CV_32FC1)),
      step(pooledMat(size, CV_32FC1)),
      score(pooledMat(size, CV_32FC1)),
      curvature(pooledMat(size, CV_32FC1)),
      second_score(pooledMat(size, CV_32FC1)),
      plane(pooledMat(size, CV_32SC1)),
      voters(pooledMat(size, CV_32SC1)),
      at_limit(pooledMat(size, CV_8UC1)) {
  forEachRow(size.height, [&](int y) {
    for (cv::Mat* mat : {&inverse_range, &step, &score, &curvature}) {
      std::fill_n(mat->ptr<float>(y), size.width, kNaN);
    }
    std::fill_n(second_score.ptr<float>(y), size.width, -1.0f);
    std::fill_n(plane.ptr<int>(y), size.width, -1);
    std::fill_n(voters.ptr<int>(y), size.width, 0);
    std::fill_n(at_limit.ptr<uint8_t>(y), size.width, uint8_t{0});
  });
}

Hypotheses makePlaneHypotheses(const PlaneFamily& family, const RayTable& rays, const cv::Mat& valid_mask) {
  Hypotheses hypotheses;
  hypotheses.are_planes = true;
  hypotheses.normal = family.normal.cast<float>();
  hypotheses.weight = cv::Mat(rays.size(), CV_32FC1);
  hypotheses.offsets = family.inverse_distances_per_m;
  hypotheses.are_uniform = family.is_uniform;
  cv::Mat counts(rays.size(), CV_8UC1);
  for (int y = 0; y < rays.size().height; ++y) {
    for (int x = 0; x < rays.size().width; ++x) {
      const float weight = -hypotheses.normal.dot(rays.ray(x, y));
      const bool meets = weight > 1e-3f;
      hypotheses.weight.at<float>(y, x) = meets ? weight : kNaN;
      counts.at<uint8_t>(y, x) = meets && valid_mask.at<uint8_t>(y, x) != 0 ? 255 : 0;
    }
  }
  hypotheses.window_counts = windowsInside(counts, kMatchingWindow_px);
  return hypotheses;
}

void readPeaks(const std::vector<Hypotheses>& hypotheses, const std::vector<TileScores>& scores,
               SurfaceEstimate* estimate) {
  std::vector<RowReader> families;
  int first_plane = 0;
  for (size_t f = 0; f < hypotheses.size(); ++f) {
    families.emplace_back(hypotheses[f], scores[f], first_plane);
    first_plane += static_cast<int>(hypotheses[f].offsets.size());
  }
  const cv::Rect tile = scores.front().tile;
  const std::vector<size_t> indices = layoutIndices(scores.front());
  for (int row = 0; row < tile.height; ++row) {
    for (RowReader& family : families) {
      family.setRow(row);
    }
    const EstimateRow out(estimate, tile.x, tile.y + row);
    for (int column = 0; column < tile.width; ++column) {
      const size_t pixel = indices[static_cast<size_t>(column)];
      const RowReader* chosen = nullptr;
      int best_score = kNoScore;
      for (const RowReader& family : families) {
        const int best = family.best(pixel);
        const bool counts = best >= 0 && (&family == &families.front() || family.isInside(best));
        if (counts && family.score(pixel) > best_score) {
          best_score = family.score(pixel);
          chosen = &family;
        }
      }
      if (chosen == nullptr) {
        continue;
      }
      const int best = chosen->best(pixel);
      const float step = chosen->step(best) * chosen->weight(column);
      const bool at_limit = !chosen->isInside(best);
      const Parabola parabola = at_limit ? Parabola() : chosen->parabola(pixel);
      const float inverse_range = chosen->offset(best) * chosen->weight(column);
      float second = chosen->secondScore(pixel);
      for (const RowReader& family : families) {
        if (&family != chosen) {
          second = std::max(second, family.bestPeakApart(pixel, column, inverse_range, 2.0f * step));
        }
      }
      out.inverse_range[column] = inverse_range + parabola.offset * step;
      out.step[column] = step;
      out.score[column] = kPerScore * static_cast<float>(best_score);
      out.curvature[column] = parabola.curvature / (step * step);
      out.second_score[column] = second;
      out.plane[column] = chosen->plane(best);
      out.voters[column] = static_cast<int>(chosen->voters(best, pixel));
      out.at_limit[column] = at_limit ? 255 : 0;
    }
  }
}

Hypotheses makeRefinement(const SweepInput& input, const cv::Mat& window_counts,
                          const SurfaceEstimate& estimate) {
  const int half = input.options->num_refinement_steps / 2;
  Hypotheses refinement;
  refinement.window_counts = window_counts;
  refinement.base = smoothSurface(input.kernels, estimate.inverse_range, estimate.step);
  refinement.weight = pooledMat(refinement.base.size(), CV_32FC1);
  for (int k = -half; k <= half; ++k) {
    refinement.offsets.push_back(static_cast<float>(k));
  }
  const cv::Mat step = fillUnknown(estimate.step);
  const std::vector<NeighbourUncertainty> neighbours = neighbourUncertainties(input);
  // The motion of each second row is also that of the next one.
  forEachRow((step.rows + 1) / 2, [&](int pair) {
    std::vector<float> motion(static_cast<size_t>(step.cols));
    input.kernels.largestMotion(uncertaintyRow(input, neighbours, refinement.base, 2 * pair), motion.data());
    for (int y = 2 * pair; y < std::min(2 * pair + 2, step.rows); ++y) {
      const auto* coarse_row = step.ptr<float>(y);
      auto* weight_row = refinement.weight.ptr<float>(y);
      for (int x = 0; x < step.cols; ++x) {
        const float fine = kRefinementStep_px / std::max(motion[static_cast<size_t>(x)], 1e-6f);
        // The step is fine for the neighbour that moves most, but the range reaches half way to the next
        // plane.
        const float coarse = coarse_row[x] / static_cast<float>(half);
        weight_row[x] = std::clamp(fine, 0.75f * coarse, 2.0f * coarse);
      }
    }
  });
  return refinement;
}

void readRefinement(const Hypotheses& refinement, const TileScores& scores, SurfaceEstimate* estimate) {
  const int last = static_cast<int>(refinement.offsets.size()) - 1;
  RowReader reader(refinement, scores, 0);
  const std::vector<size_t> indices = layoutIndices(scores);
  for (int row = 0; row < scores.tile.height; ++row) {
    reader.setRow(row);
    const EstimateRow out(estimate, scores.tile.x, scores.tile.y + row);
    const auto* base = refinement.base.ptr<float>(scores.tile.y + row) + scores.tile.x;
    for (int column = 0; column < scores.tile.width; ++column) {
      const size_t pixel = indices[static_cast<size_t>(column)];
      const int best = reader.best(pixel);
      if (best <= 0 || best == last) {
        continue;
      }
      const float best_score = kPerScore * static_cast<float>(reader.score(pixel));
      const float weight = reader.weight(column);
      const float peak = base[column] + reader.offset(best) * weight;
      // A lower score far from the first sweep's result belongs to another peak.
      if (best_score < out.score[column] && std::abs(peak - out.inverse_range[column]) > out.step[column]) {
        continue;
      }
      const Parabola parabola = reader.parabola(pixel);
      out.inverse_range[column] = peak + parabola.offset * weight;
      out.step[column] = weight;
      out.score[column] = best_score;
      out.curvature[column] = parabola.curvature / (weight * weight);
      out.voters[column] = static_cast<int>(reader.voters(best, pixel));
      out.at_limit[column] = 0;
    }
  }
}

}  // namespace vcharge
