#include "sweep/far_planes.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "kernels/half_resolution.h"
#include "kernels/parallel_rows.h"

namespace vcharge {
namespace {

/// Leaves gaps for the slots that are not kept.
template <class IsKept>
std::vector<int> keepSlots(const std::vector<int>& slots, const IsKept& is_kept) {
  std::vector<int> kept;
  for (const int slot : slots) {
    if (slot != kGap && is_kept(slot)) {
      kept.push_back(slot);
    } else if (kept.empty() || kept.back() != kGap) {
      kept.push_back(kGap);
    }
  }
  return kept;
}

}  // namespace

FarPlanes::FarPlanes(std::shared_ptr<const SweepLevel> fine, const std::optional<Plane>& ground_in_camera)
    : fine_(std::move(fine)) {
  PlaneSweepOptions options = fine_->options();
  options.semi_global_smoothing = false;
  level_ = halfLevel(*fine_, options, ground_in_camera);
  tiles_ = makeTiles(level_->validMask().size(), options.window_px,
                     options.coarse_pass ? TileSize::kSmall : TileSize::kLarge);
  if (options.families != PlaneFamilies::kGroundParallel) {
    const std::vector<float>& offsets = fine_->planes().front().offsets;
    const auto limit = static_cast<float>(1.0 / options.half_resolution_beyond_m);
    num_far_ = static_cast<int>(std::lower_bound(offsets.begin(), offsets.end(), limit) - offsets.begin());
    num_far_ = std::min(num_far_, static_cast<int>(offsets.size()) - 2);
  }
}

std::vector<cv::Rect> FarPlanes::tilesOfFine() const {
  std::vector<cv::Rect> fine;
  for (const cv::Rect& tile : tiles_) {
    fine.emplace_back(2 * tile.x, 2 * tile.y, 2 * tile.width, 2 * tile.height);
  }
  return fine;
}

std::vector<TilePlanes> FarPlanes::farOf(const std::vector<TilePlanes>& choice) const {
  std::vector<TilePlanes> far = choice;
  for (TilePlanes& planes : far) {
    for (size_t f = 0; f < planes.size(); ++f) {
      planes[f] = keepSlots(planes[f], [&](int plane) { return f == 0 && plane <= num_far_; });
    }
  }
  return far;
}

std::vector<TilePlanes> FarPlanes::nearOf(const std::vector<TilePlanes>& choice) const {
  std::vector<TilePlanes> near = choice;
  for (TilePlanes& planes : near) {
    planes.front() = keepSlots(planes.front(), [&](int plane) { return plane >= num_far_ - 1; });
  }
  return near;
}

void FarPlanes::merge(const SweepInput& input, const SurfaceEstimate& far, SurfaceEstimate* estimate) const {
  const cv::Mat& weight = fine_->planes().front().weight;
  const cv::Mat& half_weight = level_->planes().front().weight;
  const cv::Size half = half_weight.size();
  forEachRow(weight.rows, [&](int y) {
    const int v = std::min(y / 2, half.height - 1);
    for (int x = 0; x < weight.cols; ++x) {
      const int u = std::min(x / 2, half.width - 1);
      const bool has_texture = input.reference.inverse_deviation.at<float>(y, x) > 0.0f;
      if (far.plane.at<int>(v, u) < 0 || far.plane.at<int>(v, u) >= num_far_ || !has_texture ||
          fine_->validWindows().at<uint8_t>(y, x) == 0) {
        continue;
      }
      const float score = far.score.at<float>(v, u);
      const int near_plane = estimate->plane.at<int>(y, x);
      const bool goes_on = near_plane == num_far_ - 1;  // the first near plane that was scored: no peak
      const float near_score = near_plane < 0 || goes_on ? -1.0f : estimate->score.at<float>(y, x);
      const float ratio = weight.at<float>(y, x) / half_weight.at<float>(v, u);
      const float inverse_range = far.inverse_range.at<float>(v, u) * ratio;
      const float step = far.step.at<float>(v, u) * ratio;
      if (!(score > near_score)) {
        // It may be the other peak.
        if (std::abs(inverse_range - estimate->inverse_range.at<float>(y, x)) > 2.0f * step) {
          float& second = estimate->second_score.at<float>(y, x);
          second = std::max(second, score);
        }
        continue;
      }
      const bool other_peak = near_score > -1.0f &&
                              std::abs(inverse_range - estimate->inverse_range.at<float>(y, x)) > 2.0f * step;
      estimate->second_score.at<float>(y, x) =
          std::max(far.second_score.at<float>(v, u), other_peak ? near_score : -1.0f);
      estimate->inverse_range.at<float>(y, x) = inverse_range;
      estimate->step.at<float>(y, x) = step;
      estimate->score.at<float>(y, x) = score;
      estimate->curvature.at<float>(y, x) = far.curvature.at<float>(v, u) / (ratio * ratio);
      estimate->plane.at<int>(y, x) = far.plane.at<int>(v, u);
      estimate->voters.at<int>(y, x) = far.voters.at<int>(v, u);
      estimate->at_limit.at<uint8_t>(y, x) = far.at_limit.at<uint8_t>(v, u);
    }
  });
}

std::vector<TilePlanes> allPlanes(const SweepLevel& level, size_t num_tiles) {
  TilePlanes all;
  for (const Hypotheses& planes : level.planes()) {
    all.emplace_back(planes.offsets.size());
    std::iota(all.back().begin(), all.back().end(), 0);
  }
  return std::vector<TilePlanes>(num_tiles, all);
}

}  // namespace vcharge
