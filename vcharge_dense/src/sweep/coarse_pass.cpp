#include "sweep/coarse_pass.h"

#include <algorithm>
#include <utility>

#include <tbb/parallel_for.h>

namespace vcharge {
namespace {

// Chosen on two simulated drives that are not used for evaluation. Sizes are in pixels of the coarse image.
// All planes are swept if a smaller fraction of a tile's pixels with texture is confident.
constexpr double kMinConfidentFraction = 0.3;
constexpr int kMinConfident = 16;
constexpr size_t kMinHalvedSide = 4;  // number of images on one side of which half are left out
constexpr int kReach_px = 2;          // margin of pixels around a tile that also select its planes
constexpr int kMinCount = 8;          // minimum number of confident pixels that select a plane
constexpr int kMarginPlanes = 1;      // planes on both sides of a selected one that are swept too

/// Slots of the selected planes and their margin, with a gap where planes are left out.
std::vector<int> slotsOf(const std::vector<int>& counts) {
  const int num_planes = static_cast<int>(counts.size());
  std::vector<int> slots;
  for (int plane = 0; plane < num_planes; ++plane) {
    int count = 0;
    for (int i = std::max(0, plane - kMarginPlanes); i <= std::min(num_planes - 1, plane + kMarginPlanes);
         ++i) {
      count = std::max(count, counts[static_cast<size_t>(i)]);
    }
    if (count >= kMinCount) {
      slots.push_back(plane);
    } else if (slots.empty() || slots.back() != kGap) {
      slots.push_back(kGap);
    }
  }
  return slots;
}

/// Fractional index of a value among the offsets of a family, extrapolated beyond their ends.
float fractionalIndex(float value, const Hypotheses& family) {
  const std::vector<float>& offsets = family.offsets;
  if (family.are_uniform || !(value == value)) {  // NaN differs from itself
    return (value - offsets.front()) * (1.0f / (offsets[1] - offsets[0]));
  }
  const auto after = std::upper_bound(offsets.begin() + 1, offsets.end() - 1, value);
  const float before = *(after - 1);
  return static_cast<float>(after - 1 - offsets.begin()) + (value - before) / (*after - before);
}

bool hasGaps(const TilePlanes& planes) {
  return std::any_of(planes.begin(), planes.end(), [](const std::vector<int>& slots) {
    return std::find(slots.begin(), slots.end(), kGap) != slots.end();
  });
}

/// Drops the pixels of the neighbours at every second baseline from the second shortest on, on each side.
void leaveOutHalf(const SweepInput& fine, SweepPixels* half_pixels) {
  for (const bool after : {false, true}) {
    std::vector<size_t> side;
    for (size_t n = 0; n < fine.neighbours.size(); ++n) {
      if (fine.neighbours[n].after == after) {
        side.push_back(n);
      }
    }
    if (side.size() < kMinHalvedSide) {
      continue;
    }
    std::stable_sort(side.begin(), side.end(), [&](size_t a, size_t b) {
      return fine.neighbours[a].translation_m.norm() < fine.neighbours[b].translation_m.norm();
    });
    for (size_t i = 1; i < side.size(); i += 2) {
      half_pixels->neighbours[side[i]].release();
    }
  }
}

}  // namespace

CoarsePass::CoarsePass(std::shared_ptr<const SweepLevel> fine, const std::optional<Plane>& ground_in_camera)
    : fine_(std::move(fine)) {
  PlaneSweepOptions options = fine_->options();
  options.num_planes = std::max(3, (options.num_planes + 1) / 2);
  options.num_ground_planes = std::max(3, (options.num_ground_planes + 1) / 2);
  options.warp_tolerance_px *= 2.0;  // its surface only guides the main sweep
  level_ = halfLevel(*fine_, options, ground_in_camera);
}

CoarseSurface CoarsePass::sweep(const SweepInput& fine, SweepPixels half_pixels, bool is_predicted) const {
  if (is_predicted) {
    leaveOutHalf(fine, &half_pixels);
  }
  SweepInput half_input = halfInput(*level_, fine, half_pixels);
  const std::vector<cv::Rect> tiles = makeTiles(level_->validMask().size(), TileSize::kLarge);
  SurfaceEstimate estimate = level_->sweepPlanes(half_input, tiles, {});
  std::vector<cv::Mat>& left = half_pixels.neighbours;
  left.erase(std::remove_if(left.begin(), left.end(), [](const cv::Mat& image) { return image.empty(); }),
             left.end());
  return {std::move(half_pixels), std::move(half_input), std::move(estimate)};
}

TilePlanes CoarsePass::choosePlanes(const SurfaceEstimate& coarse, const cv::Rect& tile) const {
  const std::vector<Hypotheses>& planes = fine_->planes();
  std::vector<std::vector<int>> counts;
  for (const Hypotheses& family : planes) {
    counts.emplace_back(family.offsets.size(), 0);
  }
  std::vector<int> confident;  // columns of a row
  const cv::Rect around(tile.x / 2 - kReach_px, tile.y / 2 - kReach_px, tile.width / 2 + 2 * kReach_px,
                        tile.height / 2 + 2 * kReach_px);
  const cv::Rect region = around & cv::Rect(cv::Point(), coarse.score.size());
  int num_textured = 0, num_confident = 0;
  for (int y = region.y; y < region.br().y; ++y) {
    const auto* plane = coarse.plane.ptr<int>(y);
    const auto* score = coarse.score.ptr<float>(y);
    const auto* second_score = coarse.second_score.ptr<float>(y);
    const auto* inverse_range = coarse.inverse_range.ptr<float>(y);
    confident.clear();
    for (int x = region.x; x < region.br().x; ++x) {
      num_textured += plane[x] >= 0 ? 1 : 0;
      if (plane[x] >= 0 && isConfident(score[x], second_score[x])) {
        confident.push_back(x);
      }
    }
    num_confident += static_cast<int>(confident.size());
    for (size_t f = 0; f < planes.size(); ++f) {
      const auto* weight = planes[f].weight.ptr<float>(2 * y);
      const auto end = static_cast<float>(planes[f].offsets.size());
      for (const int x : confident) {
        const float index = fractionalIndex(inverse_range[x] / weight[2 * x], planes[f]) + 0.5f;
        if (index > 0.0f && index < end) {  // false for NaN
          ++counts[f][static_cast<size_t>(index)];
        }
      }
    }
  }
  TilePlanes result;
  const bool is_confident =
      num_confident >= kMinConfident && num_confident >= kMinConfidentFraction * num_textured;
  for (std::vector<int>& count : counts) {
    if (!is_confident) {
      std::fill(count.begin(), count.end(), kMinCount);
    }
    result.push_back(slotsOf(count));
  }
  return result;
}

std::vector<TilePlanes> CoarsePass::choosePlanes(const SurfaceEstimate& coarse,
                                                 const std::vector<cv::Rect>& tiles) const {
  std::vector<TilePlanes> choice(tiles.size());
  tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t i) { choice[i] = choosePlanes(coarse, tiles[i]); });
  return choice;
}

void CoarsePass::addSecondPeaks(const SurfaceEstimate& coarse, const std::vector<cv::Rect>& tiles,
                                const std::vector<TilePlanes>& choice, SurfaceEstimate* estimate) const {
  const cv::Size size = coarse.score.size();
  tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t i) {
    if (!hasGaps(choice[i])) {
      return;
    }
    for (int y = tiles[i].y; y < tiles[i].br().y; ++y) {
      const auto* from = coarse.second_score.ptr<float>(std::min(y / 2, size.height - 1));
      auto* to = estimate->second_score.ptr<float>(y);
      for (int x = tiles[i].x; x < tiles[i].br().x; ++x) {
        to[x] = std::max(to[x], from[std::min(x / 2, size.width - 1)]);
      }
    }
  });
}

}  // namespace vcharge
