#include "parking/divider_paint.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr double kPaintRatio = 0.5, kBareRatio = 0.3;  // contrast over that of a line

/// Whether paint ends here: the ground beyond is seen and bare, or a kerb.
bool isEnd(const GroundImage& ground, const DividerLine& candidate) {
  const Eigen::Vector2d along = candidate.direction(), across = rightOf(along);
  constexpr double kMinKerb_m = 0.04, kMaxKerb_m = 0.4, kInside_m = 0.3;
  const float ground_m = ground.height_m(candidate.far_m - kInside_m * along);
  int visible = 0;
  for (const double beyond_m : {0.15, 0.25, 0.35, 0.45}) {
    const Eigen::Vector2d position_m = candidate.far_m + beyond_m * along;
    const float step_m = ground.height_m(position_m) - ground_m;
    if (!ground.at(position_m) && step_m > kMinKerb_m && step_m < kMaxKerb_m) {
      ++visible;
      continue;
    }
    const auto contrast = ground.lineContrast(position_m, across);
    if (contrast && contrast->smaller() > kPaintRatio * candidate.contrast) {
      return false;
    }
    visible += contrast && contrast->isEven(candidate.contrast) ? 1 : 0;
  }
  return visible >= 3;
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
    // The row is known to some centimetres only.
    for (const double offset_m : {0.0, -0.05, 0.05}) {
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

DividerLength lengthOf(const GroundImage& ground, const BayLattice& lattice, const LatticeLines& lines,
                       const BaySizes& sizes) {
  constexpr double kEndSigma_m = 0.06, kSmallestSigma_m = 0.03, kAgree_m = 0.25;
  struct End {
    double at_m;
    bool is_seen;
  };
  std::vector<End> ends;
  for (const auto& [index, candidate] : lines) {
    const double at_m = lattice.coordinatesOf(candidate.far_m).y();
    ends.push_back({at_m, at_m >= sizes.min_length && isEnd(ground, candidate)});
  }
  // Lines that end in the same place vote for it, and longer ones against it.
  int most_votes = 0;
  std::vector<double> agreeing_m;
  for (const End& end : ends) {
    std::vector<double> same_m;
    int votes = 0;
    for (const End& other : ends) {
      if (end.is_seen && other.is_seen && std::abs(other.at_m - end.at_m) <= kAgree_m) {
        same_m.push_back(other.at_m);
        ++votes;
      }
      votes -= other.at_m > end.at_m + kAgree_m ? 1 : 0;
    }
    if (votes > most_votes) {
      most_votes = votes;
      agreeing_m = same_m;
    }
  }
  if (agreeing_m.empty()) {
    // What hides the ends may leave one line, but a longer line may also be another marking.
    double longest_m = sizes.usual_length;
    for (const End& end : ends) {
      const auto as_long = std::count_if(ends.begin(), ends.end(),
                                         [&](const End& other) { return other.at_m >= end.at_m - kAgree_m; });
      if (as_long >= 2 && 2 * as_long >= static_cast<std::ptrdiff_t>(ends.size()) &&
          end.at_m <= sizes.max_length) {
        longest_m = std::max(longest_m, end.at_m);
      }
    }
    return {longest_m, sizes.length_sigma, false};
  }
  const auto count = static_cast<double>(agreeing_m.size());
  return {quantile(agreeing_m, 0.5), std::max(kSmallestSigma_m, kEndSigma_m / std::sqrt(count)), true};
}

}  // namespace vcharge
