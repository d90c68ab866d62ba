#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "parking/bay_lattice.h"
#include "parking/divider_paint.h"
#include "parking/ground_image.h"
#include "parking/paint_lines.h"

namespace vcharge {

/// A lattice and the lines that lie on it.
struct FoundLattice {
  BayLattice lattice;
  LatticeLines lines;
};

/// Searches painted lines for rows of bays of one kind, the row with the most lines first.
class LatticeSearch {
 public:
  /// Lines of a row that was found are marked in `is_used`; lines that are marked there are not used.
  LatticeSearch(const GroundImage& ground, const std::vector<PaintLine>& lines, const BaySizes& sizes,
                std::vector<bool>* is_used);

  /// The next row, if there is one: the ground between and along its dividers does not contradict.
  std::optional<FoundLattice> next();

  /// Looks along the part of a divider that bays of any length have.
  DividerPaint paintOf(const FoundLattice& found, int number, double contrast) const;

 private:
  struct Score {
    double seen;  ///< number of lines that are seen, less those that should be
    double rank;  ///< less hidden ones too
  };

  bool isPossible(const BayLattice& lattice) const;
  std::vector<std::pair<double, BayLattice>> guesses() const;
  void eraseWrong(FoundLattice* found) const;
  Score checkedScore(const FoundLattice& found) const;

  const GroundImage& ground_;
  const BaySizes sizes_;
  std::vector<bool>& is_used_;
  std::vector<DividerLine> lines_;
};

}  // namespace vcharge
