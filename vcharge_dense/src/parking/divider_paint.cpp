#include "parking/divider_paint.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// Across a line, which is known to some centimetres only.
constexpr std::array<double, 3> kOffsets_m{0.0, -0.05, 0.05};
constexpr double kPaintRatio = 0.5, kBareRatio = 0.3;  // contrast over that of a line

/// Contrast of the paint at a place of a line. Nothing unless both sides are seen.
std::optional<double> contrastNear(const GroundImage& ground, const Eigen::Vector2d& position_m,
                                   const Eigen::Vector2d& across) {
  std::optional<double> best;
  for (const double offset_m : kOffsets_m) {
    const auto found = ground.lineContrast(position_m + offset_m * across, across);
    if (found && found->to_left && found->to_right) {
      best = std::max(best.value_or(found->smaller()), found->smaller());
    }
  }
  return best;
}

}  // namespace

DividerPaint paintAlong(const GroundImage& ground, const Eigen::Vector2d& entry_m,
                        const Eigen::Vector2d& depth_m, double line_contrast) {
  constexpr double kMargin_m = 0.3;
  const double length_m = depth_m.norm(), step_m = ground.cellSize_m();
  const Eigen::Vector2d along = depth_m / length_m, across = rightOf(along);
  DividerPaint paint;
  for (double at_m = kMargin_m; at_m < length_m - kMargin_m; at_m += step_m) {
    bool is_painted = false, is_bare = false;
    for (const double offset_m : kOffsets_m) {
      if (const auto found = ground.lineContrast(entry_m + at_m * along + offset_m * across, across)) {
        is_painted |= found->smaller() >= kPaintRatio * line_contrast;
        is_bare |=
            offset_m == 0.0 && found->isEven(line_contrast) && found->smaller() < kBareRatio * line_contrast;
      }
    }
    paint.painted_m += is_painted ? step_m : 0.0;
    paint.bare_m += is_bare && !is_painted ? step_m : 0.0;
  }
  return paint;
}

double paleContrast(const LatticeLines& lines) {
  std::vector<double> contrasts;
  for (const auto& [index, candidate] : lines) {
    contrasts.push_back(candidate.contrast);
  }
  return quantile(contrasts, 0.25);
}

DividerExtent extentOf(const GroundImage& ground, const BayLattice& lattice, const std::vector<int>& numbers,
                       double line_contrast, const BaySizes& sizes) {
  constexpr double kBefore_m = 2.0, kMinContrast = 0.02, kBareRun_m = 0.3, kUnseenRun_m = 0.5;
  constexpr double kSeenSigma_m = 0.06;
  constexpr size_t kMinDividers = 2;
  const double step_m = ground.cellSize_m();
  const double least = std::max(kMinContrast, kBareRatio * line_contrast);
  const Eigen::Vector2d across = rightOf(lattice.into);
  enum class Seen { kPaint, kBare, kNothing };
  const auto seenAt = [&](double along_m) {
    std::vector<double> contrasts;
    for (const int number : numbers) {
      if (const auto found = contrastNear(ground, lattice.entryOf(number) + along_m * lattice.into, across)) {
        contrasts.push_back(*found);
      }
    }
    if (contrasts.size() < kMinDividers) {
      return Seen::kNothing;
    }
    // The lower median: another marking may prolong one line.
    std::sort(contrasts.begin(), contrasts.end());
    return contrasts[(contrasts.size() - 1) / 2] >= least ? Seen::kPaint : Seen::kBare;
  };
  // The last painted place before the ground is bare, or nothing is seen; the start if none is painted.
  const auto walk = [&](double from_m, double to_m, bool* is_end) {
    const double direction = to_m > from_m ? 1.0 : -1.0;
    double last_m = from_m, bare_m = 0.0, unseen_m = 0.0;
    *is_end = false;
    for (double at_m = from_m; direction * (to_m - at_m) > 0.0; at_m += direction * step_m) {
      const Seen seen = seenAt(at_m);
      if (seen == Seen::kPaint) {
        last_m = at_m;
        bare_m = unseen_m = 0.0;
      }
      bare_m += seen == Seen::kBare ? step_m : 0.0;
      unseen_m += seen == Seen::kNothing ? step_m : 0.0;
      *is_end = bare_m >= kBareRun_m;
      if (*is_end || unseen_m >= kUnseenRun_m) {
        break;
      }
    }
    return last_m;
  };
  DividerExtent extent;
  const double inside_m = 0.5 * sizes.min_length;
  bool is_begin = false;
  extent.begin_m = walk(inside_m, -kBefore_m, &is_begin) - 0.5 * step_m;
  // Lines begin at the lattice's points or before them; further in, cars hide too much.
  if (!is_begin || extent.begin_m > kEntryTolerance_m) {
    extent.begin_m = 0.0;
  }
  extent.end_m = walk(inside_m, 2.0 * sizes.max_length, &extent.is_end_seen) + 0.5 * step_m;
  extent.is_end_seen = extent.is_end_seen && extent.length_m() >= sizes.min_length;
  extent.end_sigma_m = kSeenSigma_m;
  if (!extent.is_end_seen) {
    const double seen_m = extent.length_m() <= sizes.max_length ? extent.length_m() : 0.0;
    extent.end_m = extent.begin_m + std::max(seen_m, sizes.usual_length);
    extent.end_sigma_m = sizes.length_sigma;
  }
  return extent;
}

}  // namespace vcharge
