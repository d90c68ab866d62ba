#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "refinement/surface_estimate.h"
#include "sweep/sweep_input.h"
#include "sweep/tile_scorer.h"

namespace vcharge {

/// The scores of a whole sweep, for semi-global smoothing over the plane index (Hirschmueller 2008): of all
/// paths of planes through the image's pixels, from the left, right, top and bottom, the ones that cost
/// least, where a pixel costs what its correlation lacks of 1, a step to the next plane of the family
/// smoothness_step and any other jump smoothness_jump. About five bytes per pixel and plane.
class PlaneSmoothing {
 public:
  PlaneSmoothing(cv::Size size, const std::vector<Hypotheses>& families, const PlaneSweepOptions& options);

  /// Keeps the scores of one tile; different tiles at the same time.
  void addTile(const std::vector<TileScores>& scores);

  /// Replaces the planes of those pixels that have one by those of the best paths, and the second peak's
  /// score by one that is as much lower as the best path through another peak costs more. The result does not
  /// depend on the number of threads.
  void smooth(bool interpolate, SurfaceEstimate* estimate);

 private:
  const int16_t* scoresAt(int x, int y) const { return scores_.data() + offsetOf(x, y); }
  size_t offsetOf(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(size_.width) + static_cast<size_t>(x)) * stride_;
  }
  void walk(int x, int y, int dx, int dy, int steps);
  void choosePlane(int x, int y, bool interpolate, SurfaceEstimate* estimate) const;

  const cv::Size size_;
  const std::vector<Hypotheses>& families_;
  const uint16_t step_cost_, jump_cost_;
  std::vector<int> first_;  // place of each family's first plane; a place that none may take before and after
  std::vector<int> family_;       // by place; -1: none
  size_t stride_ = 0;             // places of a pixel
  AlignedArray<int16_t> scores_;  // [y][x][place]
  AlignedArray<uint8_t> voters_;
  AlignedArray<uint16_t> costs_;  // sums over the paths
};

}  // namespace vcharge
