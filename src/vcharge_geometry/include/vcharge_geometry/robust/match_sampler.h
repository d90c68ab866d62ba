#pragma once

#include <cstdint>
#include <vector>

namespace vcharge {

/// Random minimal samples of matches: best matches first (Chum and Matas, "Matching with PROSAC", CVPR 2005:
/// the pool grows until, after max_iterations samples, it holds all matches), and across cameras: a sample
/// that came from one group alone has its last member replaced by one of another group, where the pool has
/// one. Matches of one camera see the scale badly or not at all. The same seed gives the same samples on any
/// machine.
class MatchSampler {
 public:
  /// qualities: higher is better; groups: any labels, one per match. With equal qualities, or without
  /// order_by_quality, all matches are drawn from at once.
  MatchSampler(const std::vector<double>& qualities, const std::vector<int>& groups, int sample_size,
               bool order_by_quality, int max_iterations, int seed);

  /// Writes sample_size different indices of matches.
  void draw(int* sample);

 private:
  int randomBelow(int limit);
  void growPool();
  bool inSample(const int* sample, int count, int match) const;

  std::vector<int> order_;
  std::vector<int> groups_;
  int sample_size_;
  uint64_t state_;
  int pool_size_;
  int num_drawn_ = 0;
  double expected_draws_;  // T_n of the paper
  int draws_of_pool_ = 1;  // T'_n
};

}  // namespace vcharge
