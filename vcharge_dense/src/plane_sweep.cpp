#include "vcharge_dense/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "range_uncertainty.h"
#include "surface_estimate.h"
#include "tile_scorer.h"
#include "vcharge_core/error.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kTileWidth = 160;
constexpr int kTileHeight = 32;
constexpr double kWholeSphere_rad = 6.283185307179586;

/// Gray levels less `mean`, NaN where the mask is 0, with a frame of NaN of the given width.
cv::Mat toFloat(const cv::Mat& pixels, const cv::Mat& mask, float mean, int frame) {
  cv::Mat framed(pixels.rows + 2 * frame, pixels.cols + 2 * frame, CV_32FC1, cv::Scalar(kNaN));
  for (int y = 0; y < pixels.rows; ++y) {
    const auto* from = pixels.ptr<uint8_t>(y);
    const auto* valid = mask.ptr<uint8_t>(y);
    auto* to = framed.ptr<float>(y + frame) + frame;
    for (int x = 0; x < pixels.cols; ++x) {
      to[x] = valid[x] != 0 ? static_cast<float>(from[x]) - mean : kNaN;
    }
  }
  return framed;
}

std::vector<cv::Rect> makeTiles(cv::Size size) {
  std::vector<cv::Rect> tiles;
  for (int y = 0; y < size.height; y += kTileHeight) {
    for (int x = 0; x < size.width; x += kTileWidth) {
      tiles.emplace_back(x, y, std::min(kTileWidth, size.width - x), std::min(kTileHeight, size.height - y));
    }
  }
  return tiles;
}

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
  families_ = makePlaneFamilies(options_, ground_in_camera);
}

RangeMap PlaneSweep::sweep(const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                           SweepDetails* details) const {
  const cv::Size size = valid_mask_.size();
  checkImage(reference, size);
  check(neighbours.size() <= 32, "PlaneSweep: at most 32 neighbours");

  const float mean = static_cast<float>(cv::mean(reference.pixels, valid_mask_)[0]);
  SweepInput input{camera_, &rays_, toFloat(reference.pixels, valid_mask_, mean, 0), {}, &options_};
  for (const SweepImage& image : neighbours) {
    checkImage(image, size);
    const RigidTransform neighbour_from_reference =
        image.world_from_camera.inverse() * reference.world_from_camera;
    SweepNeighbour neighbour;
    const cv::Mat framed = toFloat(image.pixels, valid_mask_, mean, 1);
    neighbour.framed_pixels.assign(framed.ptr<float>(), framed.ptr<float>() + framed.total());
    neighbour.neighbour_from_reference = neighbour_from_reference.rotationMatrix().cast<float>();
    neighbour.translation_m = neighbour_from_reference.translation().cast<float>();
    neighbour.after = image.stamp > reference.stamp;
    input.neighbours.push_back(std::move(neighbour));
  }

  std::vector<Hypotheses> hypotheses;
  for (const PlaneFamily& family : families_) {
    hypotheses.push_back(makePlaneHypotheses(family, rays_));
  }
  const std::vector<cv::Rect> tiles = makeTiles(size);
  SurfaceEstimate estimate(size);
  forEachTile(tiles, [&](const cv::Rect& tile) {
    TileScorer scorer(input, tile);
    std::vector<TileScores> scores(hypotheses.size());
    for (size_t f = 0; f < hypotheses.size(); ++f) {
      scorer.score(hypotheses[f], &scores[f]);
    }
    readPeaks(hypotheses, scores, options_.sub_plane_interpolation, &estimate);
  });
  const bool found = cv::countNonZero(estimate.plane >= 0) > 0;
  if (found && options_.num_refinement_steps > 0) {
    const Hypotheses refinement = makeRefinement(input, estimate);
    forEachTile(tiles, [&](const cv::Rect& tile) {
      TileScores scores;
      TileScorer(input, tile).score(refinement, &scores);
      readRefinement(refinement, scores, options_.sub_plane_interpolation, &estimate);
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
