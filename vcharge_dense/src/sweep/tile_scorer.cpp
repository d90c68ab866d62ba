#include "sweep/tile_scorer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Sizes at which a tile's reference, the neighbours' pixels that it maps to and the sums of one hypothesis
// fit into 1 MB of L2 cache.
constexpr int kTileRows = 64;
constexpr int kMaxTileColumns = 215;
constexpr int kSmallTileRows = 32, kMaxSmallTileColumns = 107;
constexpr int kNodeSpacings_px[] = {8, 4};

/// Copies the part of an image that begins at `origin` into the order of a layout.
template <class To, class From>
void copyIntoLayout(const cv::Mat& image, cv::Point origin, const TileLayout& layout, From outside, To* to) {
  std::vector<From> line(static_cast<size_t>(layout.columns()));
  const int begin = std::clamp(-origin.x, 0, layout.columns());
  const int end = std::clamp(image.cols - origin.x, begin, layout.columns());
  for (int row = 0; row < layout.rows; ++row) {
    const int y = origin.y + row;
    std::fill(line.begin(), line.end(), outside);
    if (y >= 0 && y < image.rows) {
      std::copy_n(image.ptr<From>(y) + origin.x + begin, end - begin, line.begin() + begin);
    }
    for (int s = 0; s < layout.strip; ++s) {
      const From* from = line.data() + s;
      for (int lane = 0; lane < layout.lanes; ++lane) {
        *to++ = static_cast<To>(from[lane * layout.strip]);
      }
    }
  }
}

}  // namespace

bool TileScores::isInside(int slot) const {
  const auto s = static_cast<size_t>(slot);
  return slot > 0 && s + 1 < slots.size() && slots[s - 1] != kGap && slots[s + 1] != kGap;
}

std::vector<cv::Rect> makeTiles(cv::Size image, TileSize size) {
  const int radius = kMatchingWindow_px / 2;
  const cv::Rect all(radius, radius, image.width - 2 * radius, image.height - 2 * radius);
  std::vector<cv::Rect> tiles;
  if (all.width <= 0 || all.height <= 0) {
    return tiles;
  }
  const int max_columns = size == TileSize::kSmall ? kMaxSmallTileColumns : kMaxTileColumns;
  const int rows = size == TileSize::kLarge ? kTileRows : kSmallTileRows;
  const int columns = (all.width + max_columns - 1) / max_columns;
  const int width = (all.width + columns - 1) / columns;
  const int bands = std::max(1, (all.height + rows / 2) / rows);
  const int height = (all.height + bands - 1) / bands;
  for (int y = 0; y < all.height;) {
    // The last tiles are lower, so that threads finish at about the same time.
    const int band = y + height < all.height || bands == 1 ? height : (height + 1) / 2;
    for (int x = 0; x < all.width; x += width) {
      tiles.push_back(cv::Rect(all.x + x, all.y + y, width, band) & all);
    }
    y += band;
  }
  return tiles;
}

void TileScorer::setInput(const SweepInput& input) {
  input_ = &input;
  after_.resize(input.neighbours.size());
  neighbours_.resize(input.neighbours.size());
  for (size_t n = 0; n < input.neighbours.size(); ++n) {
    const SweepNeighbour& from = input.neighbours[n];
    neighbours_[n].projection = from.projection();
    after_[n] = from.after;
  }
}

void TileScorer::setTile(const SweepInput& input, const cv::Rect& tile) {
  setInput(input);
  tile_ = tile;
  const int columns = tile.width + 2 * kRadius_px;
  halo_.lanes = input_->kernels.lanes;
  halo_.strip = std::max((columns + halo_.lanes - 1) / halo_.lanes, 2 * kRadius_px + 1);
  halo_.rows = tile.height + 2 * kRadius_px;
  grids_.clear();
  has_rays_ = false;
  const size_t row_size = halo_.rowSize();
  const cv::Point origin(tile.x - kRadius_px, tile.y - kRadius_px);
  for (Neighbour& neighbour : neighbours_) {
    neighbour.samples.resize(ringRows() * rowSamples(halo_.lanes, halo_.strip));
    neighbour.column_sums.resize(3 * row_size);
  }
  // Each sample paired with the negated sample one window above, which leaves the running sum.
  AlignedArray<int32_t> samples;
  samples.resize(halo_.size());
  copyIntoLayout<int32_t, int16_t>(input_->reference.samples, origin, halo_, 0, samples.data());
  reference_pairs_.resize(halo_.size());
  const size_t window_above = static_cast<size_t>(kMatchingWindow_px) * row_size;
  for (size_t i = 0; i < halo_.size(); ++i) {
    const int32_t old = i >= window_above ? -samples[i - window_above] : 0;
    reference_pairs_[i] = static_cast<int32_t>((static_cast<uint32_t>(samples[i]) & 0xffffu) |
                                               static_cast<uint32_t>(old) << 16);
  }
  TileLayout windows = halo_;
  windows.rows = tile.height;
  mean_.resize(windows.size());
  vote_per_covariance_.resize(windows.size());
  copyIntoLayout<float, float>(input_->reference.mean, tile.tl(), windows, 0.0f, mean_.data());
  // One vector more than a row has, because samples are computed in pairs.
  u_.assign(row_size + static_cast<size_t>(halo_.lanes), 0);
  v_.assign(row_size + static_cast<size_t>(halo_.lanes), 0);
  votes_.resize(std::max<size_t>(1, neighbours_.size()) * row_size);
}

void TileScorer::loadSurface(const Hypotheses& hypotheses) {
  TileLayout windows = halo_;
  windows.rows = tile_.height;
  copyIntoLayout<float, float>(input_->reference.inverse_deviation, tile_.tl(), windows, 0.0f,
                               vote_per_covariance_.data());
  AlignedArray<uint8_t> counts;
  counts.resize(windows.size());
  copyIntoLayout<uint8_t, uint8_t>(hypotheses.window_counts, tile_.tl(), windows, 0, counts.data());
  for (size_t i = 0; i < windows.size(); ++i) {
    const bool counts_here = counts[i] != 0 && vote_per_covariance_[i] > 0.0f;  // false for NaN
    vote_per_covariance_[i] = counts_here ? kVoteScale * vote_per_covariance_[i] : 0.0f;
  }
  for (const std::unique_ptr<NodeGrid>& grid : grids_) {
    grid->setNormal(hypotheses.normal);
  }
  // Rows at the top and bottom without usable windows need no score.
  const auto counts_in_row = [&](int row) {
    const float* begin = vote_per_covariance_.data() + static_cast<size_t>(row) * windows.rowSize();
    return std::any_of(begin, begin + windows.rowSize(), [](float value) { return value > 0.0f; });
  };
  first_row_ = 0;
  end_row_ = windows.rows;
  while (first_row_ < end_row_ && !counts_in_row(first_row_)) {
    ++first_row_;
  }
  while (end_row_ > first_row_ && !counts_in_row(end_row_ - 1)) {
    --end_row_;
  }
  base_.resize(0);  // set by prepareWarp()
  weight_.resize(0);
}

/// Prepares the projection of every pixel.
void TileScorer::loadRays(const Hypotheses& hypotheses) {
  const cv::Point origin(tile_.x - kRadius_px, tile_.y - kRadius_px);
  if (!has_rays_) {
    has_rays_ = true;
    const RayTable& rays = *input_->rays;
    const auto load = [&](const std::vector<float>& table, AlignedArray<float>* to) {
      to->resize(halo_.size());
      const cv::Mat view(rays.size(), CV_32FC1, const_cast<float*>(table.data()));
      copyIntoLayout<float, float>(view, origin, halo_, 0.0f, to->data());
    };
    load(rays.x(), &ray_x_);
    load(rays.y(), &ray_y_);
    load(rays.z(), &ray_z_);
  }
  if (weight_.size() == 0) {
    weight_.resize(halo_.size());
    copyIntoLayout<float, float>(hypotheses.weight, origin, halo_, kNaN, weight_.data());
    if (hypotheses.base.empty()) {
      base_.assign(halo_.size(), 0.0f);
    } else {
      base_.resize(halo_.size());
      copyIntoLayout<float, float>(hypotheses.base, origin, halo_, kNaN, base_.data());
    }
  }
}

RayRow TileScorer::raysAt(size_t at, float offset) const {
  return {ray_x_.data() + at, ray_y_.data() + at,  ray_z_.data() + at,
          base_.data() + at,  weight_.data() + at, offset};
}

/// Tables of positions around a surface.
void TileScorer::makeSteps(const Hypotheses& hypotheses) {
  const int reach = hypotheses.stepReach();
  has_steps_ = reach > 0 && input_->options->warp_tolerance_px > 0.0;
  if (!has_steps_) {
    return;
  }
  loadRays(hypotheses);
  const size_t first = static_cast<size_t>(first_row_) * halo_.rowSize();
  const size_t end = static_cast<size_t>(end_row_ + kMatchingWindow_px - 1) * halo_.rowSize();
  const float middle = hypotheses.offsets[static_cast<size_t>(reach)];
  const float step = hypotheses.offsets[1] - hypotheses.offsets[0];
  for (Neighbour& neighbour : neighbours_) {
    for (AlignedArray<int32_t>* array :
         {&neighbour.u, &neighbour.v, &neighbour.u_steps, &neighbour.v_steps}) {
      array->resize(halo_.size());
    }
    input_->kernels.makeSteps(neighbour.projection, raysAt(first, middle), step, reach, end - first,
                              neighbour.steps(first));
  }
}

/// Selects the coarsest grid that is accurate enough, or prepares the projection of every pixel.
void TileScorer::prepareWarp(const Hypotheses& hypotheses, float offset, Neighbour* neighbour) {
  const cv::Point origin(tile_.x - kRadius_px, tile_.y - kRadius_px);
  neighbour->grid = nullptr;
  const auto tolerance_px = static_cast<float>(input_->options->warp_tolerance_px);
  for (size_t level = 0; hypotheses.are_planes && tolerance_px > 0.0f && level < std::size(kNodeSpacings_px);
       ++level) {
    if (level == grids_.size()) {
      grids_.push_back(std::make_unique<NodeGrid>(input_->camera, *input_->near_valid, origin, halo_,
                                                  kNodeSpacings_px[level]));
      grids_.back()->setNormal(hypotheses.normal);
    }
    if (grids_[level]->makeCells(input_->kernels, neighbour->projection, offset, &neighbour->cells) <=
        tolerance_px) {
      neighbour->grid = grids_[level].get();
      return;
    }
  }
  if (!has_steps_) {
    loadRays(hypotheses);
  }
}

void TileScorer::scoreSlot(const Hypotheses& hypotheses, size_t slot, TileScores* result) {
  const SweepKernels& kernels = input_->kernels;
  const size_t row_size = halo_.rowSize();
  const int window = kMatchingWindow_px;
  const size_t ring_row = rowSamples(halo_.lanes, halo_.strip);
  const size_t num_slots = result->slots.size();
  if (result->slots[slot] == kGap) {
    for (int y = first_row_; y < end_row_; ++y) {
      std::fill_n(result->scores.data() + (static_cast<size_t>(y) * num_slots + slot) * row_size, row_size,
                  kNoScore);
    }
    return;
  }
  const int hypothesis = result->slots[slot];
  const float offset = hypotheses.offsets[static_cast<size_t>(hypothesis)];
  for (Neighbour& neighbour : neighbours_) {
    prepareWarp(hypotheses, offset, &neighbour);
    std::fill_n(neighbour.samples.data(), neighbour.samples.size(), int16_t{0});
    std::fill_n(neighbour.column_sums.data(), neighbour.column_sums.size(), 0);
  }
  CorrelationRow row;
  row.strip = halo_.strip;
  row.window = window;
  row.scale = input_->scale;
  VoteRow vote;
  vote.aggregation = input_->options->aggregation;
  vote.num_neighbours = static_cast<int>(neighbours_.size());
  vote.after = after_.data();
  vote.votes = votes_.data();
  vote.neighbour_stride = row_size;
  vote.strip = halo_.strip;
  vote.voter_stride = rowVoterBytes(halo_.lanes, halo_.strip);
  for (int y = first_row_; y < end_row_ + window - 1; ++y) {
    const int window_row = y - (window - 1);  // first row of the windows that end in this row
    const bool ends_windows = window_row >= first_row_;
    const size_t at = static_cast<size_t>(y) * row_size;
    const size_t window_at = static_cast<size_t>(std::max(0, window_row)) * row_size;
    const size_t row_slot = static_cast<size_t>(std::max(0, window_row)) * num_slots + slot;
    vote.voters = result->voter_bits.data() + row_slot * neighbours_.size() * vote.voter_stride;
    for (size_t n = 0; n < neighbours_.size(); ++n) {
      Neighbour& neighbour = neighbours_[n];
      if (neighbour.grid != nullptr) {
        row.cells = neighbour.cells.data() + neighbour.grid->cellOffset(y);
        row.cell_shift = neighbour.grid->cellShift();
        row.row_in_cell = neighbour.grid->rowInCell(y);
      } else {
        if (has_steps_) {
          kernels.walkSteps(neighbour.steps(at), hypothesis - hypotheses.stepReach(), row_size, u_.data(),
                            v_.data());
        } else {
          kernels.projectFixed(neighbour.projection, raysAt(at, offset), row_size, u_.data(), v_.data());
        }
        row.cells = nullptr;
        row.u = u_.data();
        row.v = v_.data();
      }
      row.image = input_->neighbours[n].image.cells();
      row.pitch = input_->neighbours[n].image.pitch();
      row.reference_pairs = reference_pairs_.data() + at;
      row.samples = neighbour.samples.data() + static_cast<size_t>(y) % ringRows() * ring_row;
      row.old_samples = neighbour.samples.data() + static_cast<size_t>(y + 1) % ringRows() * ring_row;
      row.column_sums = neighbour.column_sums.data();
      if (ends_windows) {
        row.reference_mean = mean_.data() + window_at;
        row.vote_per_covariance = vote_per_covariance_.data() + window_at;
        row.votes = votes_.data() + n * row_size;
        row.voters = vote.voters + n * vote.voter_stride;
      }
      kernels.correlate(row);
    }
    if (ends_windows) {
      vote.vote_per_covariance = vote_per_covariance_.data() + window_at;
      vote.scores = result->scores.data() + row_slot * row_size;
      kernels.vote(vote);
    }
  }
}

void TileScorer::score(const Hypotheses& hypotheses, TileScores* result) {
  std::vector<int> all(hypotheses.offsets.size());
  std::iota(all.begin(), all.end(), 0);
  score(hypotheses, all, result);
}

void TileScorer::score(const Hypotheses& hypotheses, const std::vector<int>& slots, TileScores* result) {
  result->tile = tile_;
  result->layout = halo_;
  result->layout.rows = tile_.height;
  result->num_neighbours = neighbours_.size();
  result->slots = slots;
  const size_t row_size = halo_.rowSize();
  const size_t size = result->layout.size();
  result->scores.resize(size * slots.size());
  result->voter_bits.resize(static_cast<size_t>(tile_.height) * slots.size() * neighbours_.size() *
                            rowVoterBytes(halo_.lanes, halo_.strip));
  for (AlignedArray<int16_t>* array : {&result->best, &result->best_score, &result->before, &result->after,
                                       &result->second, &result->second_score}) {
    array->resize(size);
  }
  loadSurface(hypotheses);
  if (first_row_ < end_row_) {
    makeSteps(hypotheses);
    for (size_t slot = 0; slot < slots.size(); ++slot) {
      scoreSlot(hypotheses, slot, result);
    }
  }
  const size_t first = static_cast<size_t>(first_row_) * row_size;
  const size_t end = static_cast<size_t>(end_row_) * row_size;
  for (AlignedArray<int16_t>* array : {&result->best, &result->second}) {
    std::fill_n(array->data(), first, int16_t{-1});
    std::fill_n(array->data() + end, size - end, int16_t{-1});
  }
  for (size_t at = first; at < end; at += row_size) {
    const Peaks peaks{result->best.data() + at,   result->best_score.data() + at,
                      result->before.data() + at, result->after.data() + at,
                      result->second.data() + at, result->second_score.data() + at};
    input_->kernels.findPeaks(result->scores.data() + at * slots.size(), row_size,
                              static_cast<int>(slots.size()), row_size, peaks);
  }
}

}  // namespace vcharge
