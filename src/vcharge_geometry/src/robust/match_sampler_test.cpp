#include "vcharge_geometry/robust/match_sampler.h"

#include <algorithm>
#include <array>
#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(MatchSamplerTest, DrawsDifferentMatchesUniformly) {
  constexpr int kNumMatches = 20;
  constexpr int kNumDraws = 20000;
  MatchSampler sampler(std::vector<double>(kNumMatches, 1.0), std::vector<int>(kNumMatches, 0), 3, true, 1000,
                       5);
  std::vector<int> counts(kNumMatches, 0);
  for (int i = 0; i < kNumDraws; ++i) {
    std::array<int, 3> sample;
    sampler.draw(sample.data());
    EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), 3U);
    for (const int match : sample) {
      ++counts[static_cast<size_t>(match)];
    }
  }
  // The expected count is 3000 with a binomial deviation of 50.
  EXPECT_GE(*std::min_element(counts.begin(), counts.end()), 2700);
  EXPECT_LE(*std::max_element(counts.begin(), counts.end()), 3300);
}

TEST(MatchSamplerTest, TakesTheBestFirstAndAllInTheEnd) {
  constexpr int kNumMatches = 100;
  std::vector<double> qualities;
  for (int i = 0; i < kNumMatches; ++i) {
    qualities.push_back(i);
  }
  MatchSampler sampler(qualities, std::vector<int>(kNumMatches, 0), 2, true, 1000, 5);
  std::array<int, 2> sample;
  sampler.draw(sample.data());
  EXPECT_EQ((std::set<int>{sample[0], sample[1]}), (std::set<int>{98, 99}));
  int worst_of_early = kNumMatches;
  int worst_of_late = kNumMatches;
  for (int i = 1; i < 2000; ++i) {
    sampler.draw(sample.data());
    int& worst = i < 50 ? worst_of_early : worst_of_late;
    worst = std::min({worst, sample[0], sample[1]});
  }
  EXPECT_GT(worst_of_early, 50);
  EXPECT_EQ(worst_of_late, 0);
}

TEST(MatchSamplerTest, MixesCamerasWhereThereAreSeveral) {
  std::vector<int> groups(100, 0);
  std::fill(groups.begin() + 70, groups.end(), 1);
  MatchSampler sampler(std::vector<double>(100, 1.0), groups, 2, false, 1000, 5);
  int num_mixed = 0;
  for (int i = 0; i < 1000; ++i) {
    std::array<int, 2> sample;
    sampler.draw(sample.data());
    num_mixed += groups[static_cast<size_t>(sample[0])] != groups[static_cast<size_t>(sample[1])] ? 1 : 0;
  }
  // Ten attempts fail with probability 0.03 at 30 of 100 matches.
  EXPECT_GE(num_mixed, 950);
}

TEST(MatchSamplerTest, SameSeedGivesSameSamples) {
  std::vector<double> qualities(50);
  for (size_t i = 0; i < qualities.size(); ++i) {
    qualities[i] = static_cast<double>(i % 7);
  }
  const std::vector<int> groups(50, 3);
  MatchSampler first(qualities, groups, 4, true, 100, 9);
  MatchSampler second(qualities, groups, 4, true, 100, 9);
  MatchSampler other(qualities, groups, 4, false, 100, 10);
  int num_different = 0;
  for (int i = 0; i < 200; ++i) {
    std::array<int, 4> a;
    std::array<int, 4> b;
    std::array<int, 4> c;
    first.draw(a.data());
    second.draw(b.data());
    other.draw(c.data());
    EXPECT_EQ(a, b);
    num_different += a != c ? 1 : 0;
  }
  EXPECT_GT(num_different, 150);
}

TEST(MatchSamplerTest, RefusesFewerMatchesThanASample) {
  EXPECT_THROW(MatchSampler({1.0, 1.0}, {0, 0}, 3, true, 100, 1), std::logic_error);
  EXPECT_THROW(MatchSampler({1.0, 1.0}, {0}, 2, true, 100, 1), std::logic_error);
}

}  // namespace
}  // namespace vcharge
