#include "parking/lattice_search.h"

#include <algorithm>

namespace vcharge {
namespace {

constexpr double kStepError = 0.02;  // error of the step of a lattice through two lines, over the step
constexpr double kNotAtLane = 0.4;   // weight of a line whose end at the lane is not seen

double scoreOf(const BayLattice& lattice, const LatticeLines& lines) {
  double score = 0.0;
  for (const auto& [number, line] : lines) {
    score += lattice.beginsAtLane(line) ? 1.0 : kNotAtLane;
  }
  return score;
}

double longestOf(const LatticeLines& lines) {
  double longest_m = 0.0;
  for (const auto& [number, line] : lines) {
    longest_m = std::max(longest_m, line.length_m());
  }
  return longest_m;
}

}  // namespace

LatticeSearch::LatticeSearch(const GroundImage& ground, const std::vector<PaintLine>& lines,
                             const BaySizes& sizes, std::vector<bool>* is_used)
    : ground_(ground), sizes_(sizes), is_used_(*is_used) {
  for (size_t i = 0; i < lines.size(); ++i) {
    const PaintLine& line = lines[i];
    // Lines of two rows back to back are twice as long.
    if (line.length_m() >= kMinVisible_m && line.length_m() <= 2.0 * sizes.max_length) {
      lines_.push_back({i, line.from_m, line.to_m, line.contrast});
      lines_.push_back({i, line.to_m, line.from_m, line.contrast});
    }
  }
}

bool LatticeSearch::isPossible(const BayLattice& lattice) const {
  constexpr double kAngled_sine =
      0.94;  // 70 degrees; nothing is between angled bays and those at right angles
  const double width_m = lattice.width_m(), sine = lattice.sine();
  return width_m >= sizes_.min_width && width_m <= sizes_.max_width && sine >= sizes_.min_sine &&
         (sine < kAngled_sine || lattice.isAtRightAngles());
}

std::vector<std::pair<double, BayLattice>> LatticeSearch::guesses() const {
  constexpr int kMostApart = 3;  // bays between two lines: what hides others may leave no nearer ones
  constexpr double kLeastScore = 2.0;
  std::vector<std::pair<double, BayLattice>> guesses;
  for (const DividerLine& a : lines_) {
    for (const DividerLine& b : lines_) {
      const Eigen::Vector2d between_m = b.entry_m - a.entry_m;
      if (a.line >= b.line || is_used_[a.line] || is_used_[b.line] ||
          between_m.norm() > kMostApart * sizes_.max_width / sizes_.min_sine ||
          a.direction().dot(b.direction()) < kSameDirection) {
        continue;
      }
      for (int num_bays = 1; num_bays <= kMostApart; ++num_bays) {
        const BayLattice lattice{a.entry_m, between_m / num_bays,
                                 (a.direction() + b.direction()).normalized()};
        if (!isPossible(lattice)) {
          continue;
        }
        const LatticeLines lines = linesOn(lattice, lines_, is_used_, sizes_, kStepError);
        const double score = scoreOf(lattice, lines);
        if (score > kLeastScore && longestOf(lines) >= 0.5 * sizes_.min_length &&
            !isFilled(lattice, lines, lines_)) {
          guesses.emplace_back(score, lattice);
        }
      }
    }
  }
  return guesses;
}

DividerPaint LatticeSearch::paintOf(const FoundLattice& found, int number, double contrast) const {
  return paintAlong(ground_, found.lattice.entryOf(number), sizes_.min_length * found.lattice.into, contrast);
}

void LatticeSearch::eraseWrong(FoundLattice* found) const {
  for (auto line = found->lines.begin(); line != found->lines.end();) {
    const DividerPaint paint = paintOf(*found, line->first, line->second.contrast);
    line = paint.isLine() || paint.isUnclear() ? std::next(line) : found->lines.erase(line);
  }
}

LatticeSearch::Score LatticeSearch::checkedScore(const FoundLattice& found) const {
  constexpr double kHidden = 0.3;  // a row through what is seen of one row is better than one through several
  const double contrast = paleContrast(found.lines);
  Score score{scoreOf(found.lattice, found.lines), 0.0};
  int num_hidden = 0;
  for (int number = found.lines.begin()->first; number < found.lines.rbegin()->first; ++number) {
    if (found.lines.count(number) == 0) {
      const DividerPaint paint = paintOf(found, number, contrast);
      score.seen += paint.isLine() ? kNotAtLane : paint.isUnclear() ? 0.0 : -1.0;
      num_hidden += paint.isUnclear() && !paint.isLine() ? 1 : 0;
    }
  }
  score.rank = score.seen - kHidden * num_hidden;
  return score;
}

std::optional<FoundLattice> LatticeSearch::next() {
  constexpr std::ptrdiff_t kMostChecked = 300;
  constexpr double kLeastScore = 2.5;
  std::vector<std::pair<double, BayLattice>> guessed = guesses();
  const auto checked_end =
      guessed.begin() + std::min(kMostChecked, static_cast<std::ptrdiff_t>(guessed.size()));
  std::stable_sort(guessed.begin(), guessed.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::optional<FoundLattice> best;
  double best_rank = 0.0;
  for (auto guess = guessed.begin(); guess != checked_end; ++guess) {
    FoundLattice found{guess->second, linesOn(guess->second, lines_, is_used_, sizes_, kStepError)};
    for (int round = 0; round < 3 && found.lines.size() >= 2; ++round) {
      found.lattice = adjusted(found.lattice, found.lines);
      found.lines = linesOn(found.lattice, lines_, is_used_, sizes_, round == 0 ? kStepError : 0.0);
      eraseWrong(&found);
    }
    if (found.lines.size() < 2 || !isPossible(found.lattice)) {
      continue;
    }
    const Score score = checkedScore(found);
    if (score.seen > kLeastScore && (!best || score.rank > best_rank)) {
      best_rank = score.rank;
      best = std::move(found);
    }
  }
  if (best) {
    for (const auto& [number, line] : best->lines) {
      is_used_[line.line] = true;
    }
  }
  return best;
}

}  // namespace vcharge
