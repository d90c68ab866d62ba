#include "vcharge_dense/plane_sweep.h"

#include <stdexcept>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "pose_refinement.h"
#include "range_uncertainty.h"
#include "surface_estimate.h"
#include "tile_scorer.h"
#include "vcharge_core/error.h"

namespace vcharge {
namespace {

constexpr double kWholeSphere_rad = 6.283185307179586;
// Node grids need positions this far around valid pixels.
constexpr int kNearValid_px = 17;

constexpr int kMinWidth_px = 16;  // the most lanes that a vector has

/// Tiles are independent of each other, hence of who computes them.
template <class Function>
void forEachTile(const std::vector<cv::Rect>& tiles, const Function& function) {
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, tiles.size(), 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t i = range.begin(); i < range.end(); ++i) {
          function(tiles[i]);
        }
      },
      tbb::simple_partitioner());
}

void checkImage(const SweepImage& image, cv::Size size) {
  check(image.pixels.type() == CV_8UC1 && image.pixels.size() == size,
        "PlaneSweep: images must be CV_8UC1 of the working camera's size");
}

}  // namespace

PlaneSweep::PlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
                       const std::optional<Plane>& ground_in_camera)
    : camera_(camera),
      valid_mask_(valid_mask.clone()),
      options_(options),
      rays_(camera, valid_mask.size(), kWholeSphere_rad, valid_mask) {
  options_.validate();
  const MeiCamera::Parameters p = camera.parameters();
  check(p.tail<4>().isZero(0.0), "PlaneSweep: the working camera must not have distortion");
  check(valid_mask.cols >= kMinWidth_px, "PlaneSweep: images must be at least 16 pixels wide");
  families_ = makePlaneFamilies(options_, ground_in_camera);
  auto planes = std::make_shared<std::vector<Hypotheses>>();
  for (const PlaneFamily& family : families_) {
    planes->push_back(makePlaneHypotheses(family, rays_, valid_mask_, options_.window_px));
  }
  planes_ = planes;
  valid_windows_ = windowsInside(valid_mask_, options_.window_px);
  cv::dilate(valid_mask_, near_valid_, cv::Mat::ones(2 * kNearValid_px + 1, 2 * kNearValid_px + 1, CV_8UC1));
}

RangeMap PlaneSweep::sweep(const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                           SweepDetails* details) const {
  const cv::Size size = valid_mask_.size();
  checkImage(reference, size);
  check(neighbours.size() <= 32, "PlaneSweep: at most 32 neighbours");

  const SampleScale scale = SampleScale::forWindow(options_.window_px);
  SweepInput input{camera_,
                   &rays_,
                   &near_valid_,
                   &options_,
                   sweepKernels(),
                   scale,
                   SweepReference(reference.pixels, options_, scale),
                   {}};
  std::optional<PoseRefinement> poses;
  if (options_.refine_poses) {
    poses.emplace(camera_, reference.pixels, valid_mask_, options_.pose_noise);
  }
  std::vector<std::optional<SweepNeighbour>> prepared(neighbours.size());
  tbb::parallel_for(size_t{0}, neighbours.size(), [&](size_t n) {
    const SweepImage& image = neighbours[n];
    checkImage(image, size);
    PoseRefinement::Result pose;
    pose.neighbour_from_reference = image.world_from_camera.inverse() * reference.world_from_camera;
    if (poses) {
      pose = poses->refine(image.pixels, pose.neighbour_from_reference);
    }
    prepared[n].emplace(SweepNeighbour{
        PackedImage(image.pixels, valid_mask_), pose.neighbour_from_reference.rotationMatrix().cast<float>(),
        pose.neighbour_from_reference.translation().cast<float>(), image.stamp > reference.stamp,
        static_cast<float>(pose.rotation_variance_left), static_cast<float>(pose.translation_variance_left)});
  });
  for (std::optional<SweepNeighbour>& neighbour : prepared) {
    input.neighbours.push_back(std::move(*neighbour));
  }

  const std::vector<cv::Rect> tiles =
      neighbours.empty() ? std::vector<cv::Rect>() : makeTiles(size, options_.window_px);
  SurfaceEstimate estimate(size);
  struct Worker {
    TileScorer scorer;
    std::vector<TileScores> scores;
  };
  tbb::enumerable_thread_specific<Worker> workers([&] {
    return Worker{TileScorer(input), std::vector<TileScores>(planes_->size())};
  });
  forEachTile(tiles, [&](const cv::Rect& tile) {
    Worker& worker = workers.local();
    worker.scorer.setTile(tile);
    for (size_t f = 0; f < planes_->size(); ++f) {
      worker.scorer.score((*planes_)[f], &worker.scores[f]);
    }
    readPeaks(*planes_, worker.scores, options_.sub_plane_interpolation, &estimate);
  });
  const bool found = cv::countNonZero(estimate.plane >= 0) > 0;
  if (found && options_.num_refinement_steps > 0) {
    const Hypotheses refinement = makeRefinement(input, valid_windows_, estimate);
    forEachTile(tiles, [&](const cv::Rect& tile) {
      Worker& worker = workers.local();
      worker.scorer.setTile(tile);
      worker.scorer.score(refinement, &worker.scores.front());
      readRefinement(refinement, worker.scores.front(), options_.sub_plane_interpolation, &estimate);
    });
  }

  RangeMap map{reference.stamp, "", "", camera_, {}, {}, {}};
  estimateRange(input, estimate, &map);
  if (details != nullptr) {
    details->score = estimate.score;
    details->plane = estimate.plane;
    details->voters = estimate.voters;
  }
  return map;
}

}  // namespace vcharge
