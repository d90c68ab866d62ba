#include "height_map/fusion/column_optimum.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// Cost of a height by equation perColumnMin of the paper.
double costOf(const std::vector<float>& weights, int height) {
  double cost = 0.0;
  for (int z = 0; z < static_cast<int>(weights.size()); ++z) {
    cost += z < height ? -weights[z] : weights[z];
  }
  return cost;
}

ColumnOptimum optimumOf(const std::vector<float>& weights) {
  return findColumnOptimum(weights.data(), static_cast<int>(weights.size()));
}

TEST(ColumnOptimumTest, IsTheLowestOfTheBestHeightsOfEveryColumn) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<float> weights(1 + random() % 12);
    for (float& weight : weights) {
      weight = static_cast<float>(static_cast<int>(random() % 5) -
                                  2);  // with zeros several heights have equal costs
    }
    int best = 0;
    for (int height = 1; height <= static_cast<int>(weights.size()); ++height) {
      best = costOf(weights, height) < costOf(weights, best) ? height : best;
    }
    const ColumnOptimum optimum = optimumOf(weights);
    EXPECT_EQ(optimum.height_index, best);
    EXPECT_DOUBLE_EQ(optimum.min_cost, costOf(weights, best));
    EXPECT_DOUBLE_EQ(optimum.occupied_cost, costOf(weights, static_cast<int>(weights.size())));
  }
}

TEST(ColumnOptimumTest, HeaviestRunIsTheHeaviestOfAllRuns) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<float> weights(1 + random() % 12);
    for (float& weight : weights) {
      weight = static_cast<float>(static_cast<int>(random() % 7) - 4);
    }
    const int size = static_cast<int>(weights.size()), begin = static_cast<int>(random() % 3) % size;
    double heaviest = 0.0;
    for (int first = begin; first < size; ++first) {
      for (int top = first; top <= size; ++top) {
        heaviest = std::max(heaviest, std::accumulate(weights.begin() + first, weights.begin() + top, 0.0));
      }
    }
    const VoxelRun run = heaviestRun(weights.data(), begin, size);
    EXPECT_GE(run.first, begin);
    EXPECT_DOUBLE_EQ(run.weight, heaviest);
    EXPECT_DOUBLE_EQ(std::accumulate(weights.begin() + run.first, weights.begin() + run.top, 0.0), heaviest);
    EXPECT_EQ(run.top > run.first, heaviest > 0.0);
  }
}

TEST(ColumnOptimumTest, LiesOnTopOfOccupiedVoxelsUnderUnknownSpace) {
  // From bottom to top: ground, unknown, free.
  const ColumnOptimum optimum = optimumOf({0, 2, 3, 0, 0, 0, -1, -4});
  EXPECT_EQ(optimum.height_index, 3);
  EXPECT_TRUE(optimum.has_surface);
}

TEST(ColumnOptimumTest, FreeSpaceAloneIsNoSurface) {
  EXPECT_FALSE(optimumOf({0, 0, 0, -1, -4}).has_surface);
  EXPECT_EQ(optimumOf({0, 0, 0, -1, -4}).height_index, 0);
  EXPECT_FALSE(optimumOf({0, 0, 0}).has_surface);
}

TEST(ColumnOptimumTest, TakesTheStrongerOfTwoSurfaces) {
  EXPECT_EQ(optimumOf({3, -1, 1, -1}).height_index, 1);
  EXPECT_EQ(optimumOf({3, -1, 2, -1}).height_index, 3);
}

TEST(ColumnOptimumTest, FindsALayerAlthoughTheFreeSpaceUnderItOutweighsIt) {
  // From bottom to top: ground, a gap, a car's body with little evidence, unknown.
  const std::vector<float> weights = {3, -4, -4, 2, 2, 0, 0};
  const auto optimum = [&](double min_layer_weight) {
    return findColumnOptimum(weights.data(), static_cast<int>(weights.size()), min_layer_weight);
  };
  EXPECT_EQ(optimumOf(weights).height_index, 1);
  EXPECT_EQ(optimum(4.5).height_index, 1);
  EXPECT_EQ(optimum(4.5).layer_weight, 0.0);
  EXPECT_EQ(optimum(4.0).height_index, 5);
  EXPECT_EQ(optimum(4.0).layer_weight, 4.0);
  EXPECT_EQ(optimum(4.0).min_cost, -15.0);  // the cost of ground, gap and body without contrary evidence
  EXPECT_EQ(optimum(4.0).occupied_cost, optimumOf(weights).occupied_cost);
}

TEST(ColumnOptimumTest, TheLayerIsTheHeaviestRunAboveTheBestHeight) {
  std::mt19937 random(8);
  int num_layers = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<float> weights(1 + random() % 12);
    for (float& weight : weights) {
      weight = static_cast<float>(static_cast<int>(random() % 7) - 3);
    }
    const auto size = static_cast<int>(weights.size());
    const ColumnOptimum single = optimumOf(weights);
    double heaviest = 0.0;
    int top = 0;
    for (int end = single.height_index + 1; end <= size; ++end) {
      for (int begin = single.height_index; begin < end; ++begin) {
        const double sum = std::accumulate(weights.begin() + begin, weights.begin() + end, 0.0);
        top = sum > heaviest ? end : top;
        heaviest = std::max(heaviest, sum);
      }
    }
    const ColumnOptimum layered = findColumnOptimum(weights.data(), size, 2.0);
    const bool has_layer = heaviest >= 2.0;
    num_layers += has_layer ? 1 : 0;
    EXPECT_EQ(layered.height_index, has_layer ? top : single.height_index);
    EXPECT_EQ(layered.layer_weight, has_layer ? heaviest : 0.0);
    EXPECT_EQ(layered.min_cost, single.min_cost - 2.0 * layered.layer_weight);
  }
  EXPECT_GT(num_layers, 100);
}

}  // namespace
}  // namespace vcharge
