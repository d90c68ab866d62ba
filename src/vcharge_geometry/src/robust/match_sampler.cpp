#include "vcharge_geometry/robust/match_sampler.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "vcharge_core/base/error.h"

namespace vcharge {

MatchSampler::MatchSampler(const std::vector<double>& qualities, const std::vector<int>& groups,
                           int sample_size, bool order_by_quality, int max_iterations, int seed)
    : order_(qualities.size()),
      groups_(groups),
      sample_size_(sample_size),
      state_(static_cast<uint64_t>(seed)),
      pool_size_(static_cast<int>(qualities.size())),
      expected_draws_(max_iterations) {
  check(groups.size() == qualities.size(), "MatchSampler: as many groups as qualities");
  check(sample_size >= 1 && sample_size <= pool_size_, "MatchSampler: fewer matches than a sample");
  std::iota(order_.begin(), order_.end(), 0);
  const auto [worst, best] = std::minmax_element(qualities.begin(), qualities.end());
  if (order_by_quality && *worst < *best) {
    std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) {
      return qualities[static_cast<size_t>(a)] > qualities[static_cast<size_t>(b)];
    });
    const int num_matches = pool_size_;
    pool_size_ = sample_size;
    for (int i = 0; i < sample_size; ++i) {
      expected_draws_ *= static_cast<double>(sample_size - i) / static_cast<double>(num_matches - i);
    }
  }
}

int MatchSampler::randomBelow(int limit) {
  // SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), since the standard library's distributions differ between
  // implementations.
  state_ += 0x9E3779B97F4A7C15ULL;
  uint64_t mixed = state_;
  mixed = (mixed ^ (mixed >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  mixed = (mixed ^ (mixed >> 27U)) * 0x94D049BB133111EBULL;
  mixed ^= mixed >> 31U;
  return static_cast<int>(((mixed >> 32U) * static_cast<uint64_t>(limit)) >> 32U);
}

void MatchSampler::growPool() {
  while (num_drawn_ >= draws_of_pool_ && pool_size_ < static_cast<int>(order_.size())) {
    const double next =
        expected_draws_ * (pool_size_ + 1) / static_cast<double>(pool_size_ + 1 - sample_size_);
    draws_of_pool_ += static_cast<int>(std::ceil(next - expected_draws_));
    expected_draws_ = next;
    ++pool_size_;
  }
}

bool MatchSampler::inSample(const int* sample, int count, int match) const {
  return std::find(sample, sample + count, match) != sample + count;
}

void MatchSampler::draw(int* sample) {
  const int old_pool_size = pool_size_;
  growPool();
  ++num_drawn_;
  int count = 0;
  if (pool_size_ > old_pool_size) {
    // The first sample after the pool has grown contains its newest member.
    sample[count++] = order_[static_cast<size_t>(pool_size_ - 1)];
  }
  while (count < sample_size_) {
    const int match = order_[static_cast<size_t>(randomBelow(pool_size_))];
    if (!inSample(sample, count, match)) {
      sample[count++] = match;
    }
  }
  const auto groupOf = [this](int match) { return groups_[static_cast<size_t>(match)]; };
  const int group = groupOf(sample[0]);
  if (std::any_of(sample, sample + sample_size_, [&](int match) { return groupOf(match) != group; })) {
    return;
  }
  // Limited to a few attempts, since the pool may hold few or no matches of other groups.
  for (int attempt = 0; attempt < 10; ++attempt) {
    const int match = order_[static_cast<size_t>(randomBelow(pool_size_))];
    if (groupOf(match) != group) {
      sample[sample_size_ - 1] = match;
      return;
    }
  }
}

}  // namespace vcharge
