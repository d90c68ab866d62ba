#pragma once

#include <cstdint>
#include <vector>

namespace vcharge {

/// Draws random minimal samples of matches, best matches first (Chum and Matas, "Matching with PROSAC", CVPR
/// 2005): the pool grows until it holds all matches after max_iterations samples. If all members of a sample
/// come from one group, the last one is replaced by one of another group if possible, since matches of a
/// single camera constrain the scale weakly. The same seed gives the same samples on any machine.
class MatchSampler {
 public:
  /// `qualities`: higher is better. `groups`: any labels, one per match. With equal qualities, or without
  /// order_by_quality, samples come from all matches at once.
  MatchSampler(const std::vector<double>& qualities, const std::vector<int>& groups, int sample_size,
               bool order_by_quality, int max_iterations, int seed);

  /// Writes the indices of sample_size different matches.
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
  double expected_draws_;  // T_n in the paper
  int draws_of_pool_ = 1;  // T'_n in the paper
};

}  // namespace vcharge
