#include "sweep_level.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "tile_scorer.h"

namespace vcharge {
namespace {

constexpr double kWholeSphere_rad = 6.283185307179586;
// Node grids need positions this far around valid pixels.
constexpr int kNearValid_px = 17;

struct Worker {
  TileScorer scorer;
  std::vector<TileScores> scores;
};

/// Calls function(tile's index, worker) with the tile set. Tiles are independent of each other, hence of who
/// computes them.
template <class Function>
void forEachTile(const SweepInput& input, const std::vector<cv::Rect>& tiles, size_t num_families,
                 const Function& function) {
  tbb::enumerable_thread_specific<Worker> workers([&] {
    return Worker{TileScorer(input), std::vector<TileScores>(num_families)};
  });
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, tiles.size(), 1),
      [&](const tbb::blocked_range<size_t>& range) {
        Worker& worker = workers.local();
        for (size_t i = range.begin(); i < range.end(); ++i) {
          worker.scorer.setTile(tiles[i]);
          function(i, &worker);
        }
      },
      tbb::simple_partitioner());
}

}  // namespace

SweepLevel::SweepLevel(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
                       const std::optional<Plane>& ground_in_camera)
    : camera_(camera),
      valid_mask_(valid_mask.clone()),
      valid_windows_(windowsInside(valid_mask_, options.window_px)),
      options_(options),
      rays_(camera, valid_mask.size(), kWholeSphere_rad, valid_mask),
      families_(makePlaneFamilies(options, ground_in_camera)) {
  for (const PlaneFamily& family : families_) {
    planes_.push_back(makePlaneHypotheses(family, rays_, valid_mask_, options_.window_px));
  }
  cv::dilate(valid_mask_, near_valid_, cv::Mat::ones(2 * kNearValid_px + 1, 2 * kNearValid_px + 1, CV_8UC1));
}

SweepInput SweepLevel::makeInput(const cv::Mat& reference_pixels) const {
  const SampleScale scale = SampleScale::forWindow(options_.window_px);
  return {camera_,
          &rays_,
          &near_valid_,
          &options_,
          sweepKernels(),
          scale,
          SweepReference(reference_pixels, options_, scale),
          {}};
}

SurfaceEstimate sweepPlanes(const SweepInput& input, const std::vector<Hypotheses>& planes,
                            const std::vector<cv::Rect>& tiles, const std::vector<TilePlanes>& choice) {
  SurfaceEstimate estimate(input.reference.samples.size());
  forEachTile(input, tiles, planes.size(), [&](size_t tile, Worker* worker) {
    for (size_t f = 0; f < planes.size(); ++f) {
      if (choice.empty()) {
        worker->scorer.score(planes[f], &worker->scores[f]);
      } else {
        worker->scorer.score(planes[f], choice[tile][f], &worker->scores[f]);
      }
    }
    readPeaks(planes, worker->scores, input.options->sub_plane_interpolation, &estimate);
  });
  return estimate;
}

void refineSurface(const SweepInput& input, const Hypotheses& refinement, const std::vector<cv::Rect>& tiles,
                   SurfaceEstimate* estimate) {
  forEachTile(input, tiles, 1, [&](size_t, Worker* worker) {
    worker->scorer.score(refinement, &worker->scores.front());
    readRefinement(refinement, worker->scores.front(), input.options->sub_plane_interpolation, estimate);
  });
}

}  // namespace vcharge
