#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "sweep/node_grid.h"
#include "sweep/sweep_input.h"
#include "sweep/tile_layout.h"

namespace vcharge {

/// A slot of scores between planes that are not neighbours.
constexpr int kGap = -1;

/// Scores of one tile, in the order of its layout.
struct TileScores {
  cv::Rect tile;      ///< pixels that were scored; those of the layout beyond its columns mean nothing
  TileLayout layout;  ///< its rows are the tile's
  size_t num_neighbours = 0;
  std::vector<int> slots;           ///< the hypotheses that were scored, in order, and kGap between them
  AlignedArray<int16_t> scores;     ///< [row][slot][pixel in row]: correlation times kScoreScale
  std::vector<uint8_t> voter_bits;  ///< [row][slot][neighbour][pixel in row / 8]
  AlignedArray<int16_t> best, best_score, before, after, second, second_score;  ///< see Peaks, by slot

  /// Bit n: neighbour n took part in the slot's score at a pixel.
  uint32_t voters(int slot, size_t pixel) const {
    return voters(slot, pixel / layout.rowSize(), pixel % layout.rowSize());
  }
  uint32_t voters(int slot, size_t row, size_t pixel_in_row) const;
  /// The hypotheses before and after the slot's were scored as well.
  bool isInside(int slot) const;
};

enum class TileSize {
  kLarge,  ///< fewest windows that reach beyond a tile
  kSmall,  ///< fewest depths in a tile
};
/// Tiles of the pixels whose window lies in an image. Their sizes are fixed, whoever computes them; to be
/// taken in order.
std::vector<cv::Rect> makeTiles(cv::Size image, int window_px, TileSize size = TileSize::kLarge);

/// Correlates a tile of the reference with its neighbours (at least one) warped over hypothetical surfaces.
/// One object per thread, for any number of tiles; it keeps its memory.
class TileScorer {
 public:
  /// The input is used until the next call.
  void setTile(const SweepInput& input, const cv::Rect& tile);
  void score(const Hypotheses& hypotheses, TileScores* result);
  /// Only some hypotheses, see TileScores.
  void score(const Hypotheses& hypotheses, const std::vector<int>& slots, TileScores* result);

 private:
  struct Neighbour {
    Projection projection;
    AlignedArray<float> cells;
    AlignedArray<int16_t> samples;  // the last ringRows() rows
    AlignedArray<int32_t> column_sums;
    const NodeGrid* grid = nullptr;  // null: every pixel is projected
  };

  size_t ringRows() const { return static_cast<size_t>(input_->options->window_px) + 1; }
  void setInput(const SweepInput& input);
  void loadSurface(const Hypotheses& hypotheses);
  void placeNeighbour(const Hypotheses& hypotheses, float offset, Neighbour* neighbour);
  void scoreSlot(const Hypotheses& hypotheses, size_t slot, TileScores* result);

  const SweepInput* input_ = nullptr;
  int radius_ = 0;
  cv::Rect tile_;
  int first_row_ = 0, end_row_ = 0;  // of the tile, between which windows count
  TileLayout halo_;                  // the tile with the rows and columns that windows reach into
  std::vector<std::unique_ptr<NodeGrid>> grids_;  // coarse to fine
  std::vector<Neighbour> neighbours_;
  AlignedArray<int32_t> reference_pairs_;
  AlignedArray<float> mean_, vote_per_covariance_;  // of the tile's rows
  bool has_rays_ = false;
  AlignedArray<float> ray_x_, ray_y_, ray_z_, base_, weight_;  // with the halo
  AlignedArray<int32_t> u_, v_;                                // of one row
  AlignedArray<int32_t> votes_;                                // of one row, per neighbour
  AlignedArray<bool> after_;
};

}  // namespace vcharge
