#include "parking/divider_paint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// Across a line, which is known to some centimetres only.
constexpr std::array<double, 3> kOffsets_m{0.0, -0.05, 0.05};
constexpr size_t kMinDividers = 2;                     // that agree on where lines end
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

/// Where the surface rises along most dividers after a place of them: at a kerb or a wall, to which lines are
/// painted. The foot of a wall is round in a height map, hence where half of the height is reached.
std::optional<double> riseAfter(const GroundImage& ground, const BayLattice& lattice,
                                const std::vector<int>& numbers, double from_m) {
  constexpr double kReach_m = 0.7, kLeastStep_m = 0.05, kHighest_m = 0.4;
  const int steps = static_cast<int>(std::lround(kReach_m / ground.cellSize_m()));
  std::vector<double> rises_m;
  size_t num_level = 0;
  for (const int number : numbers) {
    std::vector<double> heights_m;  // over that at the place
    double first_m = std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector2d at_m =
          lattice.entryOf(number) + (from_m + i * ground.cellSize_m()) * lattice.into;
      const double height_m = ground.height_m(at_m);
      heights_m.push_back(height_m - (heights_m.empty() ? height_m : first_m));
      first_m = heights_m.size() == 1 ? height_m : first_m;
    }
    double top_m = 0.0;
    for (const double height_m : heights_m) {
      top_m = std::isfinite(height_m) ? std::max(top_m, std::min(height_m, kHighest_m)) : top_m;
    }
    const auto half = std::find_if(heights_m.begin(), heights_m.end(),
                                   [&](double height_m) { return height_m >= 0.5 * top_m; });
    if (top_m >= kLeastStep_m) {
      rises_m.push_back(from_m + static_cast<double>(half - heights_m.begin()) * ground.cellSize_m());
    } else if (std::isfinite(first_m)) {
      ++num_level;
    }
  }
  return rises_m.size() >= kMinDividers && rises_m.size() > num_level
             ? std::optional(quantile(std::move(rises_m), 0.5))
             : std::nullopt;
}

/// Contrasts of the dividers at one place along them, where both sides are seen, in ascending order.
std::vector<double> contrastsAt(const GroundImage& ground, const BayLattice& lattice,
                                const std::vector<int>& numbers, double along_m) {
  std::vector<double> contrasts;
  for (const int number : numbers) {
    if (const auto found =
            contrastNear(ground, lattice.entryOf(number) + along_m * lattice.into, rightOf(lattice.into))) {
      contrasts.push_back(*found);
    }
  }
  std::sort(contrasts.begin(), contrasts.end());
  return contrasts;
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
  const double step_m = ground.cellSize_m();
  const double least = std::max(kMinContrast, kBareRatio * line_contrast);
  // Where few of the dividers are still seen, they may belong to another row behind this one.
  size_t most_seen = 0;
  for (double along_m = 0.0; along_m < sizes.min_length; along_m += kUnseenRun_m) {
    most_seen = std::max(most_seen, contrastsAt(ground, lattice, numbers, along_m).size());
  }
  const size_t least_seen = std::max(kMinDividers, (most_seen + 3) / 4);
  enum class Seen { kPaint, kBare, kNothing };
  const auto seenAt = [&](double along_m) {
    const std::vector<double> contrasts = contrastsAt(ground, lattice, numbers, along_m);
    if (contrasts.size() < least_seen) {
      return Seen::kNothing;
    }
    // The lower median: another marking may prolong one line.
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
  if (const auto rise_m = riseAfter(ground, lattice, numbers, extent.end_m - 0.5 * step_m)) {
    extent.end_m = *rise_m;
    extent.is_end_seen = true;
  }
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
