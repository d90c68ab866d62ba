// Votes are kept in arrays of vectors here, which SVE and RVV cannot have.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vote_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include "sweep_kernels.h"
#include "sweep_kernels_internal.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using DI16 = hn::ScalableTag<int16_t>;
using VF = hn::VFromD<DF>;
using MF = decltype(hn::Lt(VF(), VF()));
using V16 = hn::VFromD<DI16>;

constexpr int kMaxNeighbours = 32;
constexpr float kLowestVote = -1.5f;  // between kNoVote and the lowest correlation

/// Mean of some neighbours' votes at one vector of pixels.
struct Mean {
  VF value;  // meaningless where nobody votes
  MF known;
};

struct Pixels {
  const VoteRow row;  // a copy: what a reference names is read again after every byte that is stored
  size_t vector;

  /// NaN and kNoVote are not more than kLowestVote.
  HWY_INLINE VF vote(int n) const {
    const DF df;
    return hn::Load(df, row.votes + static_cast<size_t>(n) * row.neighbour_stride + vector * hn::Lanes(df));
  }
  HWY_INLINE MF votes(int n) const { return hn::Gt(vote(n), hn::Set(DF(), kLowestVote)); }
  HWY_INLINE void storeVoters(int n, MF voters) const {
    const DF df;
    const size_t bytes = hn::Lanes(df) < 8 ? 1 : hn::Lanes(df) / 8;
    hn::StoreMaskBits(df, voters, row.voters + static_cast<size_t>(n) * row.voter_stride + vector * bytes);
  }
};

template <class Selects>
HWY_INLINE Mean meanOf(const Pixels& pixels, const Selects& selects) {
  const DF df;
  VF sum = hn::Zero(df), count = hn::Zero(df);
  for (int n = 0; n < pixels.row.num_neighbours; ++n) {
    if (selects(n)) {
      const VF vote = pixels.vote(n);
      const MF votes = hn::Gt(vote, hn::Set(df, kLowestVote));
      sum = hn::Add(sum, hn::IfThenElseZero(votes, vote));
      count = hn::Add(count, hn::IfThenElseZero(votes, hn::Set(df, 1.0f)));
    }
  }
  return {hn::Div(sum, count), hn::Gt(count, hn::Zero(df))};
}

HWY_INLINE void storeScores(const Pixels& pixels, const Mean& mean) {
  const DF df;
  const hn::Rebind<int16_t, DF> d16;
  const VF scaled = hn::Mul(hn::Min(mean.value, hn::Set(df, 1.0f)), hn::Set(df, kScoreScale));
  const VF known = hn::IfThenElse(mean.known, scaled, hn::Set(df, static_cast<float>(kNoScore)));
  hn::Store(hn::DemoteTo(d16, hn::NearestInt(known)), d16, pixels.row.scores + pixels.vector * hn::Lanes(df));
}

HWY_INLINE Mean meanOfAll(const Pixels& pixels) {
  const DF df;
  const int num_neighbours = pixels.row.num_neighbours;
  VF sum = pixels.vote(0);
  MF all = pixels.votes(0);
  pixels.storeVoters(0, all);
  for (int n = 1; n < num_neighbours; ++n) {
    const MF votes = pixels.votes(n);
    pixels.storeVoters(n, votes);
    sum = hn::Add(sum, pixels.vote(n));
    all = hn::And(all, votes);
  }
  if (HWY_LIKELY(hn::AllTrue(df, all))) {
    return {hn::Mul(sum, hn::Set(df, 1.0f / static_cast<float>(num_neighbours))), all};
  }
  return meanOf(pixels, [](int) { return true; });
}

/// The better of the means before and after the reference.
HWY_INLINE Mean meanOfBetterSide(const Pixels& pixels) {
  const bool* after = pixels.row.after;
  const Mean mean_before = meanOf(pixels, [after](int n) { return !after[n]; });
  const Mean mean_after = meanOf(pixels, [after](int n) { return after[n]; });
  const MF is_better = hn::Gt(mean_after.value, mean_before.value);
  const MF after_wins = hn::And(mean_after.known, hn::Or(is_better, hn::Not(mean_before.known)));
  for (int n = 0; n < pixels.row.num_neighbours; ++n) {
    const MF side = after[n] ? after_wins : hn::Not(after_wins);
    pixels.storeVoters(n, hn::And(side, pixels.votes(n)));
  }
  return {hn::IfThenElse(after_wins, mean_after.value, mean_before.value),
          hn::Or(mean_before.known, mean_after.known)};
}

/// Mean of the best_k best votes, or of all where there are fewer.
HWY_INLINE Mean meanOfBest(const Pixels& pixels) {
  const DF df;
  const VF no_vote = hn::Set(df, kNoVote);
  VF open[kMaxNeighbours];
  const int num_neighbours = pixels.row.num_neighbours;
  for (int n = 0; n < num_neighbours; ++n) {
    open[n] = hn::IfThenElse(pixels.votes(n), pixels.vote(n), no_vote);
  }
  VF sum = hn::Zero(df), count = hn::Zero(df);
  for (int k = 0; k < pixels.row.best_k; ++k) {
    VF best = no_vote;
    for (int n = 0; n < num_neighbours; ++n) {
      best = hn::Max(best, open[n]);
    }
    MF wanted = hn::Gt(best, hn::Set(df, kLowestVote));
    sum = hn::Add(sum, hn::IfThenElseZero(wanted, best));
    count = hn::Add(count, hn::IfThenElseZero(wanted, hn::Set(df, 1.0f)));
    for (int n = 0; n < num_neighbours; ++n) {
      const MF chosen = hn::And(wanted, hn::Eq(open[n], best));
      open[n] = hn::IfThenElse(chosen, no_vote, open[n]);
      wanted = hn::AndNot(chosen, wanted);
    }
  }
  for (int n = 0; n < num_neighbours; ++n) {
    const MF left = hn::Gt(open[n], hn::Set(df, kLowestVote));
    pixels.storeVoters(n, hn::AndNot(left, pixels.votes(n)));
  }
  return {hn::Div(sum, count), hn::Gt(count, hn::Zero(df))};
}

template <class Aggregate>
HWY_INLINE void voteAll(const VoteRow& row, const Aggregate& aggregate) {
  for (size_t s = 0; s < static_cast<size_t>(row.strip); ++s) {
    const Pixels pixels{row, s};
    storeScores(pixels, aggregate(pixels));
  }
}

void voteTarget(const VoteRow& row) {
  switch (row.aggregation) {
    case Aggregation::kMean:
      return voteAll(row, [](const Pixels& pixels) HWY_ATTR { return meanOfAll(pixels); });
    case Aggregation::kReferenceSplit:
      return voteAll(row, [](const Pixels& pixels) HWY_ATTR { return meanOfBetterSide(pixels); });
    case Aggregation::kBestK:
      return voteAll(row, [](const Pixels& pixels) HWY_ATTR { return meanOfBest(pixels); });
  }
}

/// The two highest peaks so far; `current` and `previous` are the last two scores.
struct PeakSearch {
  V16 previous, current, best, score, before, after, second, second_score;

  explicit HWY_INLINE PeakSearch(V16 first) {
    const DI16 d;
    previous = score = before = after = second_score = hn::Set(d, kNoScore);
    best = second = hn::Set(d, -1);
    current = first;
  }
  HWY_INLINE void advance(int k, V16 next) {
    const auto is_peak = hn::Not(hn::Or(hn::Gt(previous, current), hn::Gt(next, current)));
    const auto is_best = hn::And(is_peak, hn::Gt(current, score));
    const auto is_second = hn::And(is_peak, hn::Gt(current, second_score));
    const V16 index = hn::Set(DI16(), static_cast<int16_t>(k));
    second_score = hn::IfThenElse(is_best, score, hn::IfThenElse(is_second, current, second_score));
    second = hn::IfThenElse(is_best, best, hn::IfThenElse(is_second, index, second));
    score = hn::IfThenElse(is_best, current, score);
    best = hn::IfThenElse(is_best, index, best);
    before = hn::IfThenElse(is_best, previous, before);
    after = hn::IfThenElse(is_best, next, after);
    previous = current;
    current = next;
  }
  HWY_INLINE void store(const Peaks& peaks, size_t at) const {
    const DI16 d;
    hn::Store(best, d, peaks.best + at);
    hn::Store(score, d, peaks.score + at);
    hn::Store(before, d, peaks.before + at);
    hn::Store(after, d, peaks.after + at);
    hn::Store(second, d, peaks.second + at);
    hn::Store(second_score, d, peaks.second_score + at);
  }
};

void findPeaksTarget(const int16_t* scores, size_t stride, int num_hypotheses, size_t num_pixels,
                     const Peaks& peaks) {
  const DI16 d;
  const V16 none = hn::Set(d, kNoScore);
  for (size_t i = 0; i < num_pixels; i += hn::Lanes(d)) {
    PeakSearch search(hn::Load(d, scores + i));
    const int16_t* next = scores + i;
    for (int k = 0; k + 1 < num_hypotheses; ++k) {
      next += stride;
      search.advance(k, hn::Load(d, next));
    }
    search.advance(num_hypotheses - 1, none);
    search.store(peaks, i);
  }
}

}  // namespace

void fillVoteKernels(SweepKernels* kernels) {
  kernels->vote = &voteTarget;
  kernels->findPeaks = &findPeaksTarget;
}

}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(fillVoteKernels);

void addVoteKernels(SweepKernels* kernels) {
  HWY_DYNAMIC_DISPATCH(fillVoteKernels)(kernels);
}

}  // namespace vcharge
#endif
