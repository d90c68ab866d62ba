#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "parking/ground_image.h"

namespace vcharge {

/// Sizes of the bays of a kind, in metres, from parking regulations with margins.
struct BaySizes {
  double min_width, max_width;        ///< between dividers, at right angles to them
  double min_length, max_length;      ///< of dividers
  double usual_length, length_sigma;  ///< where no end is seen
  double min_sine;                    ///< of the angle between dividers and lane

  bool areParallelToLane() const { return min_width > max_length; }
};
inline constexpr BaySizes kBaysAcross{2.1, 3.4, 3.6, 6.5, 4.8, 0.4, 0.64};
inline constexpr BaySizes kBaysAlong{4.8, 7.5, 1.7, 2.9, 2.2, 0.2, 0.96};

/// Shortest part of a line between bays that tells something.
inline constexpr double kMinVisible_m = 0.7;
/// Cosine of the largest angle between lines of one direction.
inline constexpr double kSameDirection = 0.995;
/// Distance from the lane within which a line begins at the lane.
inline constexpr double kEntryTolerance_m = 0.25;

/// A painted line that may be a divider, with one of its ends at the lane.
struct DividerLine {
  size_t line = 0;  ///< index of the painted line
  Eigen::Vector2d entry_m, far_m;
  double contrast = 0.0;

  double length_m() const { return (far_m - entry_m).norm(); }
  Eigen::Vector2d direction() const { return (far_m - entry_m).normalized(); }
  Eigen::Vector2d middle_m() const { return 0.5 * (entry_m + far_m); }
};

/// The dividers of a row: parallel lines from points at equal distances along a lane. Dividers have numbers,
/// negative ones too.
struct BayLattice {
  Eigen::Vector2d entry_m;  ///< end of the divider 0 at the lane
  Eigen::Vector2d step_m;   ///< from one divider to the next
  Eigen::Vector2d into;     ///< unit vector from the lane into the bays

  /// Number of steps (not whole) and metres into the bays of a position.
  Eigen::Vector2d coordinatesOf(const Eigen::Vector2d& position_m) const;
  double width_m() const;
  /// Sine of the angle between dividers and lane.
  double sine() const { return width_m() / step_m.norm(); }
  bool isAtRightAngles() const;
  Eigen::Vector2d entryOf(int number) const { return entry_m + number * step_m; }
  bool beginsAtLane(const DividerLine& line) const;
};

/// Lines by the number of their divider.
using LatticeLines = std::map<int, DividerLine>;

/// The best line of each divider of a lattice, out of those that are not used. `growth` is the error of the
/// lattice's step, relative to the step.
LatticeLines linesOn(const BayLattice& lattice, const std::vector<DividerLine>& lines,
                     const std::vector<bool>& is_used, const BaySizes& sizes, double growth);

/// Whether many parallel lines lie between the dividers: hatching, a crossing.
bool isFilled(const BayLattice& lattice, const LatticeLines& lines, const std::vector<DividerLine>& all);

/// Fits a lattice to its lines by least squares. Dividers that are nearly at right angles to the lane remain
/// so.
BayLattice adjusted(const BayLattice& lattice, const LatticeLines& lines);

}  // namespace vcharge
