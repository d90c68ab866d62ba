#include "parking/divider_paint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
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

/// A kerb, a hedge or a wall, in metres along the dividers.
struct Rise {
  double begin_m, half_m;  ///< where it begins, and where half of its height is reached
};

/// The first rise of the surface above the ground in a row of cells, as indices. Nothing if the surface
/// remains level, or is not seen before it rises; the latter sets `is_unknown`.
std::optional<std::pair<size_t, size_t>> firstRise(const std::vector<double>& heights_m, double cell_m,
                                                   bool* is_unknown) {
  constexpr double kStep_m = 0.05, kRun_m = 0.3, kTopRun_m = 0.7, kHighest_m = 0.4, kGap_m = 0.2;
  const auto cells = [&](double length_m) { return static_cast<size_t>(std::lround(length_m / cell_m)); };
  const auto topAfter = [&](size_t begin, double run_m) {
    double top_m = 0.0;
    for (size_t i = begin; i < std::min(heights_m.size(), begin + cells(run_m) + 1); ++i) {
      top_m = std::isfinite(heights_m[i]) ? std::max(top_m, heights_m[i] - heights_m[begin]) : top_m;
    }
    return std::min(top_m, kHighest_m);
  };
  size_t num_unseen = 0;
  for (size_t i = 0; i < heights_m.size(); ++i) {
    num_unseen = std::isfinite(heights_m[i]) ? 0 : num_unseen + 1;
    *is_unknown = num_unseen > cells(kGap_m);
    if (*is_unknown) {
      return std::nullopt;
    }
    if (num_unseen == 0 && topAfter(i, kRun_m) >= kStep_m) {
      const double half_m = 0.5 * topAfter(i, kTopRun_m);
      size_t half = i;
      while (!(heights_m[half] - heights_m[i] >= half_m)) {
        ++half;
      }
      return std::pair(i, half);
    }
  }
  return std::nullopt;
}

/// Where the ground rises in most places side by side after a place of the dividers: at a kerb, a hedge or a
/// wall, to which lines are painted. The foot of a wall is round in a height map, hence where half of the
/// height is reached.
std::optional<Rise> riseAfter(const GroundImage& ground, const BayLattice& lattice,
                              const std::vector<int>& numbers, double from_m, double to_m) {
  constexpr int kPlaces = 4;  // per bay
  const double cell_m = ground.cellSize_m();
  std::vector<double> begins_m, halves_m;
  size_t num_level = 0;
  for (int place = kPlaces * numbers.front(); place <= kPlaces * numbers.back(); ++place) {
    const Eigen::Vector2d start_m =
        lattice.entry_m + static_cast<double>(place) / kPlaces * lattice.step_m + from_m * lattice.into;
    if (!ground.at(start_m - cell_m * lattice.into)) {
      continue;  // a car stands there
    }
    std::vector<double> heights_m;
    for (double at_m = from_m; at_m < to_m; at_m += cell_m) {
      heights_m.push_back(ground.height_m(start_m + (at_m - from_m) * lattice.into));
    }
    bool is_unknown = false;
    if (const auto rise = firstRise(heights_m, cell_m, &is_unknown)) {
      begins_m.push_back(from_m + static_cast<double>(rise->first) * cell_m);
      halves_m.push_back(from_m + static_cast<double>(rise->second) * cell_m);
    } else {
      num_level += is_unknown ? 0 : 1;
    }
  }
  if (halves_m.size() < kMinDividers || halves_m.size() <= num_level) {
    return std::nullopt;
  }
  return Rise{quantile(std::move(begins_m), 0.5), quantile(std::move(halves_m), 0.5)};
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
  constexpr double kSeenSigma_m = 0.06, kRiseSigma_m = 0.15;
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
  const double last_m = extent.end_m - 0.5 * step_m;
  const std::optional<Rise> rise = riseAfter(ground, lattice, numbers, last_m, sizes.max_length);
  // Level ground without paint before the rise is what is seen behind the ends.
  const bool is_at_rise = rise && !(extent.is_end_seen && rise->begin_m - last_m > kBareRun_m - 2.0 * step_m);
  if (is_at_rise) {
    extent.end_m = rise->half_m;
    extent.is_end_seen = true;
  }
  extent.is_end_seen = extent.is_end_seen && extent.length_m() >= sizes.min_length;
  extent.end_sigma_m = is_at_rise ? kRiseSigma_m : kSeenSigma_m;
  if (!extent.is_end_seen) {
    const double seen_m = extent.length_m() <= sizes.max_length ? extent.length_m() : 0.0;
    extent.end_m = extent.begin_m + std::max(seen_m, sizes.usual_length);
    extent.end_sigma_m = sizes.length_sigma;
  }
  return extent;
}

}  // namespace vcharge
