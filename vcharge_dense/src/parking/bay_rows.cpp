#include "parking/bay_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "parking/divider_paint.h"
#include "parking/lattice_search.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr double kEntrySigma_m = 0.05;
constexpr double kOtherRowSigma_m = 0.15;  // lengths of bays of other rows
constexpr int kMinSeen = 3;                // dividers, which tell rows from other markings
constexpr int kMostHidden = 4;             // dividers side by side

/// Makes rows of the lattices of one kind.
class RowMaker {
 public:
  RowMaker(const GroundImage& ground, const BaySizes& sizes) : ground_(ground), sizes_(sizes) {}

  void addRows(const LatticeSearch& search, const FoundLattice& found, std::vector<BayRow>* rows) const {
    BayLattice lattice = found.lattice;
    int first = 0;
    const Dividers dividers = dividersOf(search, found, &first);
    const int last = first + static_cast<int>(dividers.size()) - 1;
    std::vector<int> seen;
    for (int number = first; number <= last; ++number) {
      const auto& divider = dividers[static_cast<size_t>(number - first)];
      if (divider && divider->is_seen) {
        seen.push_back(number);
      }
    }
    const double pale_contrast = paleContrast(found.lines);
    DividerExtent extent = extentOf(ground_, lattice, seen, pale_contrast, sizes_);
    lattice.entry_m += extent.begin_m * lattice.into;
    const Eigen::Vector2d depth_m = extent.length_m() * lattice.into;
    if (extent.length_m() <= sizes_.max_length &&
        groundBefore(lattice, depth_m, lattice.into, first, last) >
            groundBefore(lattice, Eigen::Vector2d::Zero(), -lattice.into, first, last)) {
      // The lane is at the other ends.
      lattice.entry_m += depth_m;
      lattice.into = -lattice.into;
      extent = extentOf(ground_, lattice, seen, pale_contrast, sizes_);
      lattice.entry_m += extent.begin_m * lattice.into;
    }
    std::vector<BayDivider> together;
    for (int number = first; number <= last; ++number) {
      const std::optional<BayDivider>& divider = dividers[static_cast<size_t>(number - first)];
      if (divider) {
        together.push_back(*divider);
      }
      if (number == last || !divider || isIsland(lattice, number)) {
        const int begin = number + (divider ? 1 : 0) - static_cast<int>(together.size());
        addRow(lattice, extent, begin, std::move(together), rows);
        together.clear();
      }
    }
  }

 private:
  /// Nothing where the ground is bare.
  using Dividers = std::vector<std::optional<BayDivider>>;

  Dividers dividersOf(const LatticeSearch& search, const FoundLattice& found, int* first) const {
    const double pale_contrast = paleContrast(found.lines);
    const auto paint = [&](int number) {
      const auto line = found.lines.find(number);
      return search.paintOf(found, number, line == found.lines.end() ? pale_contrast : line->second.contrast);
    };
    *first = found.lines.begin()->first;
    int last = found.lines.rbegin()->first;
    while (paint(*first - 1).isLine()) {
      --*first;
    }
    while (paint(last + 1).isLine()) {
      ++last;
    }
    // A car may hide the last line, which a kerb or a wall hides from the other side.
    if (paint(*first - 1).isUnclear() && isCarAfter(found.lattice, *first - 1)) {
      --*first;
    }
    if (paint(last + 1).isUnclear() && isCarAfter(found.lattice, last)) {
      ++last;
    }
    Dividers dividers;
    int num_hidden = 0;
    for (int number = *first; number <= last; ++number) {
      const DividerPaint seen = paint(number);
      const bool is_seen = seen.isLine() || (found.lines.count(number) != 0 && seen.isUnclear());
      const bool is_bare = !is_seen && !seen.isUnclear();
      if (is_seen && num_hidden > kMostHidden) {
        std::fill(dividers.end() - num_hidden, dividers.end(), std::nullopt);
      }
      num_hidden = is_seen || is_bare ? 0 : num_hidden + 1;
      dividers.push_back(is_bare ? std::nullopt : std::optional(BayDivider{is_seen}));
    }
    return dividers;
  }

  /// Whether a car stands in the bay after a divider.
  bool isCarAfter(const BayLattice& lattice, int number) const {
    constexpr double kMinHeight_m = 0.4, kMaxHeight_m = 2.5, kMinRaised_m2 = 0.6, kMaxGround = 0.5;
    constexpr int kSamples = 40;  // in width and length
    const double sample_m2 = lattice.width_m() * sizes_.min_length / (kSamples * kSamples);
    const double ground_m = groundBeside(lattice, number);
    int count = 0, num_raised = 0, num_ground = 0;
    for (int side = kSamples / 5; side < kSamples - kSamples / 10; ++side) {
      for (int in = 0; in < kSamples; ++in) {
        const Eigen::Vector2d position_m =
            lattice.entryOf(number) +
            (side * lattice.step_m + in * sizes_.min_length * lattice.into) / static_cast<double>(kSamples);
        const double height_m = ground_.height_m(position_m) - ground_m;
        ++count;
        num_raised += height_m > kMinHeight_m && height_m < kMaxHeight_m ? 1 : 0;
        num_ground += ground_.at(position_m) ? 1 : 0;
      }
    }
    return num_raised * sample_m2 >= kMinRaised_m2 && num_ground <= kMaxGround * count;
  }

  /// Height of the ground along both dividers of the bay after a divider, and beyond their ends. NaN if none
  /// is seen.
  double groundBeside(const BayLattice& lattice, int number) const {
    constexpr double kBeyond_m = 1.0;
    std::vector<double> heights_m;
    for (double at_m = -kBeyond_m; at_m < sizes_.min_length + kBeyond_m; at_m += ground_.cellSize_m()) {
      for (const int side : {number, number + 1}) {
        const Eigen::Vector2d position_m = lattice.entryOf(side) + at_m * lattice.into;
        if (ground_.at(position_m)) {
          heights_m.push_back(ground_.height_m(position_m));
        }
      }
    }
    return heights_m.empty() ? std::numeric_limits<double>::quiet_NaN() : quantile(std::move(heights_m), 0.5);
  }

  /// Whether the place after a divider is level and higher than the lane by a kerb.
  bool isIsland(const BayLattice& lattice, int number) const {
    constexpr double kMinKerb_m = 0.07, kMaxKerb_m = 0.35, kLevel_m = 0.05;
    constexpr int kSamples = 10;  // in width and length
    std::vector<double> heights_m, lane_m;
    for (int side = 2; side < kSamples - 1; ++side) {
      for (int in = -kSamples / 2; in < kSamples; ++in) {
        const float height_m = ground_.height_m(
            lattice.entryOf(number) +
            (side * lattice.step_m + in * sizes_.min_length * lattice.into) / static_cast<double>(kSamples));
        if (in != 0 && std::isfinite(height_m)) {
          (in > 0 ? heights_m : lane_m).push_back(height_m);
        }
      }
    }
    if (heights_m.size() < kSamples * kSamples / 3 || lane_m.empty()) {
      return false;
    }
    const double kerb_m = quantile(heights_m, 0.5) - quantile(lane_m, 0.5);
    return kerb_m > kMinKerb_m && kerb_m < kMaxKerb_m &&
           quantile(heights_m, 0.75) - quantile(heights_m, 0.25) < kLevel_m;
  }

  /// How much ground is seen on the way from one end of the dividers.
  int groundBefore(const BayLattice& lattice, const Eigen::Vector2d& end_m, const Eigen::Vector2d& away,
                   int first, int last) const {
    constexpr double kFrom_m = 0.5, kTo_m = 3.5, kStep_m = 0.25;
    int count = 0;
    for (int number = first; number <= last; ++number) {
      for (double at_m = kFrom_m; at_m < kTo_m; at_m += kStep_m) {
        count += ground_.at(lattice.entryOf(number) + end_m + at_m * away) ? 1 : 0;
      }
    }
    return count;
  }

  /// A painted line that joins the dividers of a row at one of their ends.
  struct JoiningLine {
    double offset_m = 0.0;  ///< from the ends along the dividers, at the first divider
    double slope_m = 0.0;   ///< increase of the offset per bay
    double contrast = 0.0;  ///< sum over the bays
    size_t num_bays = 0;    ///< in which it is seen
  };

  /// Contrast of a line across a bay. Nothing if little of it is seen.
  std::optional<double> contrastOf(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const {
    constexpr double kMinPart = 0.4;
    const double length_m = (to_m - from_m).norm(), cell_m = ground_.cellSize_m();
    const Eigen::Vector2d along = (to_m - from_m) / length_m;
    std::vector<double> contrasts;
    for (double at_m = 0.0; at_m < length_m; at_m += cell_m) {
      const auto seen = ground_.lineContrast(from_m + at_m * along, rightOf(along));
      if (seen && seen->to_left && seen->to_right) {
        contrasts.push_back(seen->smaller());
      }
    }
    return static_cast<double>(contrasts.size()) * cell_m > kMinPart * length_m
               ? std::optional(quantile(std::move(contrasts), 0.5))
               : std::nullopt;
  }

  /// The clearest line near the ends of the dividers `at_m` along them. It may be too worn to be found
  /// without knowing where it is, and it tells the direction of a row better than short dividers. Its slope
  /// is within `max_slope_m` of `slope_m`.
  JoiningLine joiningLine(const BayRow& row, double at_m, double slope_m, double max_slope_m) const {
    constexpr double kReach_m = 0.35, kSlopeStep_m = 0.03;
    constexpr double kLeastContrast = 0.03;  // medians along bare ground are within 0.01
    const Eigen::Vector2d into = row.depth_m.normalized();
    const int offsets = static_cast<int>(std::lround(kReach_m / ground_.cellSize_m()));
    const int slopes = static_cast<int>(std::lround(max_slope_m / kSlopeStep_m));
    JoiningLine best;
    for (int slope = -slopes; slope <= slopes; ++slope) {
      for (int offset = -offsets; offset <= offsets; ++offset) {
        JoiningLine line{offset * ground_.cellSize_m(), slope_m + slope * kSlopeStep_m, 0.0, 0};
        for (size_t i = 0; i + 1 < row.dividers.size(); ++i) {
          const Eigen::Vector2d from_m = row.entry_m + (at_m + line.offset_m) * into +
                                         static_cast<double>(i) * (row.step_m + line.slope_m * into);
          const auto contrast = contrastOf(from_m, from_m + row.step_m + line.slope_m * into);
          if (contrast && *contrast > kLeastContrast) {
            line.contrast += *contrast;
            ++line.num_bays;
          }
        }
        if (line.contrast > best.contrast) {
          best = line;
        }
      }
    }
    return best;
  }

  /// Moves a row of bays along the lane to the lines that join its dividers at the entry and at the end.
  /// False if neither is seen along half of the row: the dashes of a lane look like dividers.
  bool moveToJoiningLines(BayRow* row) const {
    constexpr double kMostTurn = 0.05;  // radians
    const double max_slope_m = kMostTurn * row->step_m.norm(), length_m = row->depth_m.norm();
    JoiningLine entry = joiningLine(*row, 0.0, 0.0, max_slope_m);
    JoiningLine end = joiningLine(*row, length_m, 0.0, max_slope_m);
    const double slope_m = entry.contrast >= end.contrast ? entry.slope_m : end.slope_m;
    entry = joiningLine(*row, 0.0, slope_m, 0.0);
    end = joiningLine(*row, length_m, slope_m, 0.0);
    const size_t num_bays = row->dividers.size() - 1;
    if (2 * std::max(entry.num_bays, end.num_bays) < num_bays) {
      return false;
    }
    const Eigen::Vector2d into = row->depth_m.normalized();
    row->entry_m += entry.offset_m * into;
    row->step_m += slope_m * into;
    const Eigen::Vector2d across = rightOf(row->step_m.normalized());
    row->depth_m =
        (length_m + end.offset_m - entry.offset_m) * (across.dot(into) > 0.0 ? 1.0 : -1.0) * across;
    if (2 * end.num_bays >= num_bays) {
      row->is_end_seen = true;
      row->end_sigma_m = row->entry_sigma_m;
    }
    return true;
  }

  void addRow(const BayLattice& lattice, const DividerExtent& extent, int first,
              std::vector<BayDivider> dividers, std::vector<BayRow>* rows) const {
    BayRow row;
    row.dividers = std::move(dividers);
    // Hidden lines at the end of a row say nothing, unless a car stands between one and a line.
    const auto isIdle = [&](const BayDivider& end, const BayDivider& next, int bay) {
      return !end.is_seen && (!next.is_seen || !isCarAfter(lattice, bay));
    };
    while (row.dividers.size() >= 2 && isIdle(row.dividers.back(), row.dividers[row.dividers.size() - 2],
                                              first + static_cast<int>(row.dividers.size()) - 2)) {
      row.dividers.pop_back();
    }
    while (row.dividers.size() >= 2 && isIdle(row.dividers[0], row.dividers[1], first)) {
      row.dividers.erase(row.dividers.begin());
      ++first;
    }
    const auto num_seen = std::count_if(row.dividers.begin(), row.dividers.end(),
                                        [](const BayDivider& divider) { return divider.is_seen; });
    if (num_seen < kMinSeen) {
      return;
    }
    constexpr double kRightAngle_sine = 0.966;  // 75 degrees
    const bool is_double = extent.length_m() > sizes_.max_length;
    row.kind = sizes_.areParallelToLane()           ? BayKind::kParallel
               : lattice.sine() >= kRightAngle_sine ? BayKind::kPerpendicular
                                                    : BayKind::kAngled;
    row.entry_m = lattice.entryOf(first);
    row.step_m = lattice.step_m;
    row.depth_m = (is_double ? 0.5 : 1.0) * extent.length_m() * lattice.into;
    row.is_end_seen = extent.is_end_seen;
    row.entry_sigma_m = kEntrySigma_m;
    row.end_sigma_m = std::hypot(kEntrySigma_m, extent.end_sigma_m);
    if (sizes_.areParallelToLane() && !moveToJoiningLines(&row)) {
      return;
    }
    rows->push_back(row);
    if (is_double) {  // two rows back to back
      row.entry_m += extent.length_m() * lattice.into;
      row.depth_m = -row.depth_m;
      rows->push_back(row);
    }
  }

  const GroundImage& ground_;
  const BaySizes sizes_;
};

/// Gives rows whose ends are not seen the length of the others: the bays of a car park are alike.
void takeLengthOfOthers(std::vector<BayRow>* rows) {
  for (BayRow& row : *rows) {
    std::vector<double> lengths_m;
    for (const BayRow& other : *rows) {
      if (other.is_end_seen && other.kind == row.kind) {
        lengths_m.push_back(other.depth_m.norm());
      }
    }
    if (!row.is_end_seen && !lengths_m.empty()) {
      row.depth_m *= quantile(lengths_m, 0.5) / row.depth_m.norm();
      row.end_sigma_m = std::hypot(kEntrySigma_m, kOtherRowSigma_m);
    }
  }
}

/// Marks what is painted in a row: lines that were not taken for dividers, and numbers.
void markLinesIn(const BayRow& row, const std::vector<PaintLine>& lines, std::vector<bool>* is_used) {
  constexpr double kMargin_m = 0.3;
  const BayLattice lattice{row.entry_m, row.step_m, row.depth_m.normalized()};
  const double margin = kMargin_m / lattice.width_m();
  for (size_t i = 0; i < lines.size(); ++i) {
    const Eigen::Vector2d at = lattice.coordinatesOf(0.5 * (lines[i].from_m + lines[i].to_m));
    if (at.x() > -margin && at.x() < static_cast<double>(row.dividers.size()) - 1.0 + margin &&
        at.y() > -kMargin_m && at.y() < row.depth_m.norm() + kMargin_m) {
      (*is_used)[i] = true;
    }
  }
}

}  // namespace

std::vector<BayRow> findBayRows(const GroundImage& ground, const std::vector<PaintLine>& lines) {
  std::vector<bool> is_used(lines.size(), false);
  std::vector<BayRow> rows;
  for (const BaySizes& sizes : {kBaysAcross, kBaysAlong}) {
    LatticeSearch search(ground, lines, sizes, &is_used);
    const RowMaker maker(ground, sizes);
    while (const std::optional<FoundLattice> found = search.next()) {
      const auto num_known = static_cast<std::ptrdiff_t>(rows.size());
      maker.addRows(search, *found, &rows);
      std::for_each(rows.begin() + num_known, rows.end(),
                    [&](const BayRow& row) { markLinesIn(row, lines, &is_used); });
    }
  }
  takeLengthOfOthers(&rows);
  return rows;
}

}  // namespace vcharge
