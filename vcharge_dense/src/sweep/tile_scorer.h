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

/// Marks a slot between planes that are not adjacent.
constexpr int kGap = -1;

/// Scores of one tile in the order of its layout.
struct TileScores {
  cv::Rect tile;      ///< scored pixels; other pixels of the layout have no meaning
  TileLayout layout;  ///< has the rows of the tile
  size_t num_neighbours = 0;
  std::vector<int> slots;           ///< the scored hypotheses in order, with kGap where some are left out
  AlignedArray<int16_t> scores;     ///< [row][slot][pixel in row]: correlation times kScoreScale
  std::vector<uint8_t> voter_bits;  ///< [row][slot][neighbour][pixel in row / 8]
  AlignedArray<int16_t> best, best_score, before, after, second,
      second_score;  ///< see Peaks; hypotheses are slots

  /// Bit n: neighbour n contributed to the slot's score at a pixel.
  uint32_t voters(int slot, size_t pixel) const {
    return voters(slot, pixel / layout.rowSize(), pixel % layout.rowSize());
  }
  uint32_t voters(int slot, size_t row, size_t pixel_in_row) const;
  /// Whether the hypotheses before and after the slot's were scored too.
  bool isInside(int slot) const;
};

inline uint32_t TileScores::voters(int slot, size_t row, size_t pixel_in_row) const {
  const auto lanes = static_cast<uint32_t>(layout.lanes), pixel = static_cast<uint32_t>(pixel_in_row);
  const uint32_t byte = lanes < 8 ? pixel / lanes : pixel / 8;
  const uint32_t bit = lanes < 8 ? pixel % lanes : pixel % 8;
  const size_t row_bytes = rowVoterBytes(layout.lanes, layout.strip);
  const uint8_t* at = voter_bits.data() +
                      (row * slots.size() + static_cast<size_t>(slot)) * num_neighbours * row_bytes + byte;
  uint32_t voters = 0;
  for (uint32_t n = 0; n < num_neighbours; ++n, at += row_bytes) {
    voters |= (static_cast<uint32_t>(*at) >> bit & 1u) << n;
  }
  return voters;
}

enum class TileSize {
  kLarge,  ///< few windows reach beyond a tile
  kLow,    ///< with the tables of hypotheses around a surface fits into the cache
  kSmall,  ///< few different depths in a tile
};
/// Cuts the pixels whose window lies inside an image into tiles, independently of the number of threads.
/// Tiles should be computed in order.
std::vector<cv::Rect> makeTiles(cv::Size image, TileSize size = TileSize::kLarge);

/// Correlates a tile of the reference with its neighbours (at least one), which are warped over hypothetical
/// surfaces. One object per thread; it keeps its memory from tile to tile.
class TileScorer {
 public:
  /// The input must live until the next call.
  void setTile(const SweepInput& input, const cv::Rect& tile);
  void score(const Hypotheses& hypotheses, TileScores* result);
  /// Scores only the hypotheses of these slots, see TileScores.
  void score(const Hypotheses& hypotheses, const std::vector<int>& slots, TileScores* result);

 private:
  struct Neighbour {
    Projection projection;
    AlignedArray<float> cells;
    AlignedArray<int16_t> samples;  // ring buffer of the last ringRows() rows
    AlignedArray<int32_t> column_sums;
    const NodeGrid* grid = nullptr;                // null: every pixel is projected
    AlignedArray<int32_t> u, v, u_steps, v_steps;  // StepTable, with the halo

    StepTable steps(size_t at) {
      return {u.data() + at, v.data() + at, u_steps.data() + at, v_steps.data() + at};
    }
  };

  static constexpr size_t ringRows() { return kMatchingWindow_px + 1; }
  void setInput(const SweepInput& input);
  void loadSurface(const Hypotheses& hypotheses);
  void loadRays(const Hypotheses& hypotheses);
  void makeSteps(const Hypotheses& hypotheses);
  void prepareWarp(const Hypotheses& hypotheses, float offset, Neighbour* neighbour);
  RayRow raysAt(size_t at, float offset) const;
  void scoreSlot(const Hypotheses& hypotheses, size_t slot, TileScores* result);

  const SweepInput* input_ = nullptr;
  static constexpr int kRadius_px = kMatchingWindow_px / 2;
  cv::Rect tile_;
  int first_row_ = 0, end_row_ = 0;               // rows of the tile with usable windows
  TileLayout halo_;                               // the tile and the pixels around it that windows cover
  std::vector<std::unique_ptr<NodeGrid>> grids_;  // coarse to fine
  std::vector<Neighbour> neighbours_;
  AlignedArray<int32_t> reference_pairs_;
  AlignedArray<float> mean_, vote_per_covariance_;  // without the halo
  bool has_rays_ = false, has_steps_ = false;
  AlignedArray<float> ray_x_, ray_y_, ray_z_, base_, weight_;  // with the halo
  AlignedArray<int32_t> u_, v_;                                // one row
  AlignedArray<int32_t> votes_;                                // one row per neighbour
  AlignedArray<bool> after_;
};

}  // namespace vcharge
