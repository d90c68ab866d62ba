#include "vcharge_dense/plane_sweep.h"

#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "exposure/range_rectification.h"
#include "kernels/half_resolution.h"
#include "refinement/range_uncertainty.h"
#include "sweep/coarse_pass.h"
#include "sweep/surface_memory.h"
#include "sweep/sweep_level.h"
#include "sweep/tile_scorer.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kMinWidth_px = 16;  // largest number of lanes of a vector

void checkImage(const SweepImage& image, cv::Size size) {
  check(image.pixels.type() == CV_8UC1 && image.pixels.size() == size,
        "PlaneSweep: images must be CV_8UC1 of the working camera's size");
}

void checkNoDistortion(const MeiCamera& camera) {
  check(camera.parameters().tail<4>().isZero(0.0), "PlaneSweep: cameras must not have distortion");
}

/// Packs the neighbours' images and computes their relative poses.
void addNeighbours(const SweepLevel& level, const SweepImage& reference,
                   const std::vector<SweepImage>& neighbours, SweepInput* input) {
  std::vector<std::optional<SweepNeighbour>> prepared(neighbours.size());
  tbb::parallel_for(size_t{0}, neighbours.size(), [&](size_t n) {
    const SweepImage& image = neighbours[n];
    const SweepCamera* other = image.camera.get();
    const RigidTransform pose = image.world_from_camera.inverse() * reference.world_from_camera;
    prepared[n].emplace(
        SweepNeighbour{PackedImage(image.pixels, other != nullptr ? other->valid_mask : level.validMask()),
                       other != nullptr ? other->model : level.camera(), pose.rotationMatrix().cast<float>(),
                       pose.translation().cast<float>(), image.stamp > reference.stamp, image.noise,
                       other != nullptr ? other->valid_mask : cv::Mat(), image.exposure, reference.exposure,
                       level.camera().xi()});
  });
  for (std::optional<SweepNeighbour>& neighbour : prepared) {
    input->neighbours.push_back(std::move(*neighbour));
  }
}

/// Fills unknown pixels from the map of half the size.
void fillUnknown(const RangeMap& half, RangeMap* map) {
  for (int y = 0; y < half.range_m.rows * 2; ++y) {
    for (int x = 0; x < half.range_m.cols * 2; ++x) {
      if (std::isnan(map->range_m.at<float>(y, x))) {
        map->range_m.at<float>(y, x) = half.range_m.at<float>(y / 2, x / 2);
        map->standard_deviation_m.at<float>(y, x) = half.standard_deviation_m.at<float>(y / 2, x / 2);
        map->confidence.at<float>(y, x) = half.confidence.at<float>(y / 2, x / 2);
      }
    }
  }
}

}  // namespace

PlaneSweep::PlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
                       const std::optional<Plane>& ground_in_camera, const PlaneAxes& axes) {
  options.validate();
  checkNoDistortion(camera);
  check(valid_mask.cols >= kMinWidth_px, "PlaneSweep: images must be at least 16 pixels wide");
  level_ = std::make_shared<SweepLevel>(camera, valid_mask, options, ground_in_camera, axes);
  if (options.coarse_pass && canBeHalved(valid_mask.size())) {
    coarse_ = std::make_shared<CoarsePass>(level_, ground_in_camera);
  }
  if (options.num_fill_levels > 0 && canBeHalved(valid_mask.size())) {
    PlaneSweepOptions half_options = options;
    --half_options.num_fill_levels;
    half_ = std::make_shared<PlaneSweep>(halved(camera), halvedMask(valid_mask), half_options,
                                         ground_in_camera, axes);
  }
}

const PlaneSweepOptions& PlaneSweep::options() const {
  return level_->options();
}

const std::vector<PlaneFamily>& PlaneSweep::families() const {
  return level_->families();
}

SurfaceEstimate PlaneSweep::sweepPlanes(const SweepInput& input, const SurfaceEstimate& coarse,
                                        const SurfaceMemory* memory) const {
  const cv::Size size = level_->validMask().size();
  std::vector<cv::Rect> tiles = makeTiles(size, TileSize::kSmall);
  SurfaceEstimate estimate(size);
  if (memory != nullptr) {
    tiles = memory->apply(coarse, tiles, &estimate);
  }
  const std::vector<TilePlanes> choice = coarse_->choosePlanes(coarse, tiles);
  level_->sweepPlanes(input, tiles, choice, &estimate);
  coarse_->addSecondPeaks(coarse, tiles, choice, &estimate);
  return estimate;
}

RangeMap PlaneSweep::sweep(const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                           SweepDetails* details, const RememberedRanges* remembered) const {
  const cv::Size size = level_->validMask().size();
  checkImage(reference, size);
  SweepPixels pixels{reference.pixels, {}};
  for (const SweepImage& image : neighbours) {
    checkImage(image, image.camera ? image.camera->valid_mask.size() : size);
    if (image.camera) {
      checkNoDistortion(image.camera->model);
    }
    pixels.neighbours.push_back(image.pixels);
  }
  check(neighbours.size() <= 32, "PlaneSweep: at most 32 neighbours");
  SweepInput input = level_->makeInput(reference.pixels);
  addNeighbours(*level_, reference, neighbours, &input);
  std::optional<SurfaceMemory> memory;
  // Only where the second sweep searches around the prediction and what it does not find is dropped.
  if (remembered != nullptr && coarse_ && options().num_refinement_steps > 0 &&
      options().min_confidence > 0.0) {
    memory.emplace(*level_, remembered->range_m,
                   reference.world_from_camera.inverse() * remembered->world_from_camera, reference.exposure,
                   remembered->num_sweeps);
  }
  RangeMap map = sweep(input, pixels, details, memory ? &*memory : nullptr);
  map.stamp = reference.stamp;
  map.reference = reference.pixels;
  return reference.exposure.moves() ? rectified(map, level_->rays(), reference.exposure) : map;
}

RangeMap PlaneSweep::sweep(const SweepInput& input, const SweepPixels& pixels, SweepDetails* details,
                           const SurfaceMemory* memory) const {
  SurfaceEstimate estimate(level_->validMask().size());
  std::optional<RangeMap> half;
  if (!input.neighbours.empty() && coarse_) {
    CoarseSurface coarse = coarse_->sweep(input, halved(pixels), memory != nullptr && memory->predictsMuch());
    estimate = sweepPlanes(input, coarse.estimate, memory);
    if (half_) {
      half = half_->rangeMap(&coarse);
    }
  } else if (!input.neighbours.empty()) {
    estimate = level_->sweepPlanes(input, makeTiles(level_->validMask().size()), {});
    if (half_) {
      const SweepPixels half_pixels = halved(pixels);
      half = half_->sweep(halfInput(*half_->level_, input, half_pixels), half_pixels, nullptr, nullptr);
    }
  }
  RangeMap map = rangeMap(input, &estimate);
  if (half) {
    fillUnknown(*half, &map);
  }
  if (details != nullptr) {
    details->score = estimate.score;
    details->plane = estimate.plane;
    details->voters = estimate.voters;
  }
  return map;
}

RangeMap PlaneSweep::rangeMap(const SweepInput& input, SurfaceEstimate* estimate) const {
  const bool found = cv::countNonZero(estimate->plane >= 0) > 0;
  if (found && options().num_refinement_steps > 0) {
    level_->refineSurface(input, makeRefinement(input, level_->validWindows(), *estimate),
                          makeTiles(level_->validMask().size(), TileSize::kLow), estimate);
  }
  RangeMap map{Timestamp(), "", "", level_->camera(), {}, {}, {}};
  estimateRange(input, *estimate, &map);
  return map;
}

RangeMap PlaneSweep::rangeMap(CoarseSurface* surface) const {
  RangeMap map = rangeMap(surface->input, &surface->estimate);
  if (half_) {  // then there is a coarse pass too
    CoarseSurface coarse = coarse_->sweep(surface->input, halved(surface->pixels), false);
    fillUnknown(half_->rangeMap(&coarse), &map);
  }
  return map;
}

}  // namespace vcharge
