#include "sweep/sweep_level.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "sweep/tile_scorer.h"

namespace vcharge {
namespace {

constexpr double kWholeSphere_rad = 6.283185307179586;
// Distance around valid pixels within which node grids need positions.
constexpr int kNearValid_px = 17;

}  // namespace

/// Working memory of tiles, one worker per concurrent thread.
class SweepLevel::WorkerPool {
 public:
  struct Worker {
    TileScorer scorer;
    std::vector<TileScores> scores;
  };

  /// Calls function(tile index, worker) for each tile, with the worker's tile set and one TileScores per
  /// family. Tiles are independent of each other, so that results do not depend on the threads.
  template <class Function>
  void forEachTile(const SweepInput& input, const std::vector<cv::Rect>& tiles, size_t num_families,
                   const Function& function) {
    std::atomic<size_t> next{0};  // assigns tiles in their order, unlike the loop's index
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, tiles.size(), 1),
        [&](const tbb::blocked_range<size_t>& range) {
          std::unique_ptr<Worker> worker = take();
          worker->scores.resize(std::max(worker->scores.size(), num_families));
          for (size_t i = range.begin(); i < range.end(); ++i) {
            const size_t tile = next++;
            worker->scorer.setTile(input, tiles[tile]);
            function(tile, worker.get());
          }
          giveBack(std::move(worker));
        },
        tbb::simple_partitioner());
  }

 private:
  std::unique_ptr<Worker> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (idle_.empty()) {
      return std::make_unique<Worker>();
    }
    std::unique_ptr<Worker> worker = std::move(idle_.back());
    idle_.pop_back();
    return worker;
  }
  void giveBack(std::unique_ptr<Worker> worker) {
    const std::lock_guard<std::mutex> lock(mutex_);
    idle_.push_back(std::move(worker));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<Worker>> idle_;
};

SweepLevel::SweepLevel(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
                       const std::optional<Plane>& ground_in_camera, const PlaneAxes& axes)
    : camera_(camera),
      valid_mask_(valid_mask.clone()),
      valid_windows_(windowsInside(valid_mask_, kMatchingWindow_px)),
      options_(options),
      axes_(axes),
      rays_(camera, valid_mask.size(), kWholeSphere_rad, valid_mask),
      families_(makePlaneFamilies(options, ground_in_camera, axes)),
      workers_(std::make_unique<WorkerPool>()) {
  for (const PlaneFamily& family : families_) {
    planes_.push_back(makePlaneHypotheses(family, rays_, valid_mask_));
  }
  cv::dilate(valid_mask_, near_valid_, cv::Mat::ones(2 * kNearValid_px + 1, 2 * kNearValid_px + 1, CV_8UC1));
}

SweepLevel::~SweepLevel() = default;

SweepInput SweepLevel::makeInput(const cv::Mat& reference_pixels) const {
  const SampleScale scale = SampleScale::forWindow(kMatchingWindow_px);
  return {camera_,
          &rays_,
          &near_valid_,
          &options_,
          sweepKernels(),
          scale,
          SweepReference(reference_pixels, options_, scale),
          {}};
}

SurfaceEstimate SweepLevel::sweepPlanes(const SweepInput& input, const std::vector<cv::Rect>& tiles,
                                        const std::vector<TilePlanes>& choice) const {
  SurfaceEstimate estimate(input.reference.samples.size());
  sweepPlanes(input, tiles, choice, &estimate);
  return estimate;
}

void SweepLevel::sweepPlanes(const SweepInput& input, const std::vector<cv::Rect>& tiles,
                             const std::vector<TilePlanes>& choice, SurfaceEstimate* estimate) const {
  workers_->forEachTile(input, tiles, planes_.size(), [&](size_t tile, WorkerPool::Worker* worker) {
    for (size_t f = 0; f < planes_.size(); ++f) {
      if (choice.empty()) {
        worker->scorer.score(planes_[f], &worker->scores[f]);
      } else {
        worker->scorer.score(planes_[f], choice[tile][f], &worker->scores[f]);
      }
    }
    readPeaks(planes_, worker->scores, estimate);
  });
}

void SweepLevel::refineSurface(const SweepInput& input, const Hypotheses& refinement,
                               const std::vector<cv::Rect>& tiles, SurfaceEstimate* estimate) const {
  workers_->forEachTile(input, tiles, 1, [&](size_t, WorkerPool::Worker* worker) {
    worker->scorer.score(refinement, &worker->scores.front());
    readRefinement(refinement, worker->scores.front(), estimate);
  });
}

}  // namespace vcharge
