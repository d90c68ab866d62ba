#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/vote_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include "kernels/lane_operations-inl.h"
#include "kernels/sweep_kernels.h"
#include "kernels/sweep_kernels_internal.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

using DI16 = hn::ScalableTag<int16_t>;
using MF = decltype(hn::Lt(VF(), VF()));
using V16 = hn::VFromD<DI16>;

/// Mean of votes at one vector of pixels, from their sum.
struct Mean {
  VF value;  // in units of 1 / kVoteScale; undefined where no neighbour votes
  MF known;

  explicit HWY_INLINE Mean(VI sum) {
    const DF df;
    const DI di;
    const VI count = hn::ShiftRight<kVoteBits>(hn::Add(sum, hn::Set(di, kVote / 2)));
    const VF votes = hn::ConvertTo(df, count);
    const VF total = hn::ConvertTo(df, hn::Sub(sum, hn::ShiftLeft<kVoteBits>(count)));
    // One step of Newton's method.
    const VF estimate = hn::ApproximateReciprocal(votes);
    const VF reciprocal = hn::Mul(estimate, hn::NegMulAdd(votes, estimate, hn::Set(df, 2.0f)));
    value = hn::Mul(total, reciprocal);
    known = hn::Gt(votes, hn::Zero(df));
  }
  HWY_INLINE Mean(VF value_, MF known_) : value(value_), known(known_) {}
};

struct Pixels {
  const VoteRow row;  // a copy, because members of a reference are read again after each stored byte
  size_t vector;

  HWY_INLINE VI vote(int n) const {
    const DI di;
    return hn::Load(di, row.votes + static_cast<size_t>(n) * row.neighbour_stride + vector * hn::Lanes(di));
  }
  HWY_INLINE void storeVoters(int n, MF voters) const {
    const DF df;
    hn::StoreMaskBits(df, voters,
                      row.voters + static_cast<size_t>(n) * row.voter_stride +
                          vector * rowVoterBytes(static_cast<int>(hn::Lanes(df)), 1));
  }
};

HWY_INLINE MF votes(VI vote) {
  return hn::RebindMask(DF(), hn::Gt(vote, hn::Zero(DI())));
}

HWY_INLINE void storeScores(const Pixels& pixels, const Mean& mean) {
  const DF df;
  const hn::Rebind<int16_t, DF> d16;
  const size_t at = pixels.vector * hn::Lanes(df);
  const VF scaled =
      hn::Min(hn::Mul(mean.value, hn::Set(df, kScoreScale / kVoteScale)), hn::Set(df, kScoreScale));
  const MF counts = hn::Gt(hn::Load(df, pixels.row.vote_per_covariance + at), hn::Zero(df));
  const VF known =
      hn::IfThenElse(hn::And(mean.known, counts), scaled, hn::Set(df, static_cast<float>(kNoScore)));
  hn::Store(hn::DemoteTo(d16, nearest(known)), d16, pixels.row.scores + at);
}

HWY_INLINE Mean meanOfAll(const Pixels& pixels) {
  VI sum = pixels.vote(0);
  for (int n = 1; n < pixels.row.num_neighbours; ++n) {
    sum = hn::Add(sum, pixels.vote(n));
  }
  return Mean(sum);
}

/// The larger of the means before and after the reference.
HWY_INLINE Mean meanOfBetterSide(const Pixels& pixels) {
  const DI di;
  const bool* after = pixels.row.after;
  VI sum_before = hn::Zero(di), sum_after = hn::Zero(di);
  for (int n = 0; n < pixels.row.num_neighbours; ++n) {
    VI& side = after[n] ? sum_after : sum_before;
    side = hn::Add(side, pixels.vote(n));
  }
  const Mean mean_before(sum_before), mean_after(sum_after);
  const MF is_better = hn::Gt(mean_after.value, mean_before.value);
  const MF after_wins = hn::And(mean_after.known, hn::Or(is_better, hn::Not(mean_before.known)));
  for (int n = 0; n < pixels.row.num_neighbours; ++n) {
    const MF side = after[n] ? after_wins : hn::Not(after_wins);
    pixels.storeVoters(n, hn::And(side, votes(pixels.vote(n))));
  }
  return {hn::IfThenElse(after_wins, mean_after.value, mean_before.value),
          hn::Or(mean_before.known, mean_after.known)};
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
  }
}

/// Finds the two highest peaks; `current` and `previous` are the last two scores.
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
    hn::StoreU(best, d, peaks.best + at);
    hn::StoreU(score, d, peaks.score + at);
    hn::StoreU(before, d, peaks.before + at);
    hn::StoreU(after, d, peaks.after + at);
    hn::StoreU(second, d, peaks.second + at);
    hn::StoreU(second_score, d, peaks.second_score + at);
  }
};

void findPeaksTarget(const int16_t* scores, size_t stride, int num_hypotheses, size_t num_pixels,
                     const Peaks& peaks) {
  const DI16 d;
  const V16 none = hn::Set(d, kNoScore);
  const size_t lanes = hn::Lanes(d);
  for (size_t first = 0; first < num_pixels; first += lanes) {
    // The last vector overlaps the previous one if the number of pixels is not a multiple of the lanes.
    const size_t i = HWY_MIN(first, num_pixels - lanes);
    PeakSearch search(hn::LoadU(d, scores + i));
    const int16_t* next = scores + i;
    for (int k = 0; k + 1 < num_hypotheses; ++k) {
      next += stride;
      search.advance(k, hn::LoadU(d, next));
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
