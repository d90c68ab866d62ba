#include "refinement/plane_smoothing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

#include "kernels/parallel_rows.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kShift = 7;  // from scores to costs: 250 for what a correlation of 1 has more than one of 0
constexpr float kCostPerCorrelation = kScoreScale / (1 << kShift);
constexpr int16_t kUnknownCost = static_cast<int16_t>(kCostPerCorrelation);  // as if nothing correlated
constexpr uint16_t kBarred = 10000;
constexpr int kNumPaths = 4;
constexpr size_t kPlacesOfAVector = 32;
constexpr int kColumnsOfAStrip = 16;
constexpr int kMaxNeighbours = 8;

uint16_t costOf(double correlation) {
  return static_cast<uint16_t>(std::lround(correlation * static_cast<double>(kCostPerCorrelation)));
}

}  // namespace

PlaneSmoothing::PlaneSmoothing(cv::Size size, const std::vector<Hypotheses>& families,
                               const PlaneSweepOptions& options)
    : size_(size),
      families_(families),
      step_cost_(costOf(options.smoothness_step)),
      jump_cost_(costOf(options.smoothness_jump)) {
  family_.push_back(-1);
  for (size_t f = 0; f < families.size(); ++f) {
    first_.push_back(static_cast<int>(family_.size()));
    family_.resize(family_.size() + families[f].offsets.size(), static_cast<int>(f));
    family_.push_back(-1);
  }
  stride_ = (family_.size() + kPlacesOfAVector - 1) / kPlacesOfAVector * kPlacesOfAVector;
  family_.resize(stride_, -1);
  const size_t total = static_cast<size_t>(size.area()) * stride_;
  scores_.resize(total);
  voters_.resize(total);
  costs_.resize(total);
  forEachRow(size.height, [&](int y) {
    const size_t row = static_cast<size_t>(size.width) * stride_;
    std::fill_n(scores_.data() + offsetOf(0, y), row, kNoScore);
    std::fill_n(costs_.data() + offsetOf(0, y), row, uint16_t{0});
  });
}

void PlaneSmoothing::addTile(const std::vector<TileScores>& scores) {
  check(scores.front().num_neighbours <= kMaxNeighbours,
        "PlaneSweep: semi-global smoothing takes at most 8 neighbours");
  for (size_t f = 0; f < families_.size(); ++f) {
    const TileScores& from = scores[f];
    const size_t row_size = from.layout.rowSize();
    for (int row = 0; row < from.tile.height; ++row) {
      for (int column = 0; column < from.tile.width; ++column) {
        const size_t in_row = from.layout.index(0, column);
        if (from.best[static_cast<size_t>(row) * row_size + in_row] < 0) {
          continue;  // no plane has a score, and the memory may not have been written
        }
        const size_t to = offsetOf(from.tile.x + column, from.tile.y + row) + static_cast<size_t>(first_[f]);
        const int16_t* values = from.scores.data() + static_cast<size_t>(row) * from.slots.size() * row_size;
        for (size_t slot = 0; slot < from.slots.size(); ++slot) {
          if (from.slots[slot] != kGap) {
            const size_t place = to + static_cast<size_t>(from.slots[slot]);
            scores_[place] = values[slot * row_size + in_row];
            voters_[place] =
                static_cast<uint8_t>(from.voters(static_cast<int>(slot), static_cast<size_t>(row), in_row));
          }
        }
      }
    }
  }
}

/// Adds the costs of one path to the pixels that it passes.
void PlaneSmoothing::walk(int x, int y, int dx, int dy, int steps) {
  std::vector<uint16_t> last(stride_ + 2, 0), next(stride_ + 2, 0), barred(stride_, 0);
  for (size_t i = 0; i < stride_; ++i) {
    barred[i] = family_[i] < 0 ? kBarred : 0;
  }
  uint16_t least = 0;
  for (int step = 0; step < steps; ++step, x += dx, y += dy) {
    const int16_t* score = scoresAt(x, y);
    uint16_t* sum = costs_.data() + offsetOf(x, y);
    const auto jump = static_cast<uint16_t>(least + jump_cost_);
    const uint16_t* before = last.data();
    uint16_t* cost = next.data() + 1;
    int16_t new_least = std::numeric_limits<int16_t>::max();
    for (size_t i = 0; i < stride_; ++i) {
      const int16_t own = score[i] == kNoScore ? kUnknownCost : (int16_t{32000} - score[i]) >> kShift;
      const auto beside = static_cast<int16_t>(std::min<int16_t>(before[i], before[i + 2]) + step_cost_);
      const int16_t way = std::min({static_cast<int16_t>(before[i + 1]), beside, static_cast<int16_t>(jump)});
      const auto value = static_cast<int16_t>(own + way - least + barred[i]);
      cost[i] = static_cast<uint16_t>(value);
      sum[i] = static_cast<uint16_t>(sum[i] + value);
      new_least = std::min(new_least, value);
    }
    next.front() = next.back() = kBarred;
    least = static_cast<uint16_t>(new_least);
    last.swap(next);
  }
}

void PlaneSmoothing::choosePlane(int x, int y, bool interpolate, SurfaceEstimate* estimate) const {
  const size_t at = offsetOf(x, y);
  const int16_t* scores = scores_.data() + at;
  const uint16_t* costs = costs_.data() + at;
  size_t best = 0;
  for (size_t i = 0; i < stride_; ++i) {
    if (scores[i] != kNoScore && (best == 0 || costs[i] < costs[best])) {
      best = i;
    }
  }
  const auto f = static_cast<size_t>(family_[best]);
  const auto inverseRange = [&](size_t place) {
    const auto family = static_cast<size_t>(family_[place]);
    return families_[family].offsets[place - static_cast<size_t>(first_[family])] *
           families_[family].weight.at<float>(y, x);
  };
  const float step =
      (families_[f].offsets[1] - families_[f].offsets[0]) * families_[f].weight.at<float>(y, x);
  const float inverse_range = inverseRange(best);
  // The cheapest other valley.
  uint16_t second = std::numeric_limits<uint16_t>::max();
  for (size_t i = 1; i + 1 < stride_; ++i) {
    const bool is_valley = costs[i] <= costs[i - 1] && costs[i] <= costs[i + 1];
    if (scores[i] != kNoScore && costs[i] < second && is_valley && i != best &&
        (family_[i] == family_[best] || std::abs(inverseRange(i) - inverse_range) > 2.0f * step)) {
      second = costs[i];
    }
  }
  const bool inside = scores[best - 1] != kNoScore && scores[best + 1] != kNoScore;
  if (!inside && f > 0) {
    return;  // as in readPeaks(): it belongs to the first family
  }
  const Parabola parabola =
      inside ? fitParabola(scores[best - 1], scores[best], scores[best + 1]) : Parabola();
  const float score = static_cast<float>(scores[best]) / kScoreScale;
  const float lead = static_cast<float>(second - costs[best]) / (kNumPaths * kCostPerCorrelation);
  estimate->inverse_range.at<float>(y, x) = inverse_range + (interpolate ? parabola.offset * step : 0.0f);
  estimate->step.at<float>(y, x) = step;
  estimate->score.at<float>(y, x) = score;
  estimate->curvature.at<float>(y, x) = parabola.curvature / (step * step);
  estimate->second_score.at<float>(y, x) = std::max(score - lead, -1.0f);
  estimate->plane.at<int>(y, x) =
      static_cast<int>(best) - 1 - static_cast<int>(f);  // a place between families
  estimate->voters.at<int>(y, x) = voters_[at + best];
  estimate->at_limit.at<uint8_t>(y, x) = inside ? 0 : 255;
}

void PlaneSmoothing::smooth(bool interpolate, SurfaceEstimate* estimate) {
  // Each task has its own pixels.
  tbb::parallel_for(0, size_.height, [&](int y) {
    walk(0, y, 1, 0, size_.width);
    walk(size_.width - 1, y, -1, 0, size_.width);
  });
  tbb::parallel_for(0, (size_.width + kColumnsOfAStrip - 1) / kColumnsOfAStrip, [&](int strip) {
    const int end = std::min(size_.width, (strip + 1) * kColumnsOfAStrip);
    for (int x = strip * kColumnsOfAStrip; x < end; ++x) {
      walk(x, 0, 0, 1, size_.height);
      walk(x, size_.height - 1, 0, -1, size_.height);
    }
  });
  forEachRow(size_.height, [&](int y) {
    for (int x = 0; x < size_.width; ++x) {
      if (estimate->plane.at<int>(y, x) >= 0) {
        choosePlane(x, y, interpolate, estimate);
      }
    }
  });
}

}  // namespace vcharge
