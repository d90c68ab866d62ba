#include "height_map/column_optimum.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// Equation perColumnMin as it is printed.
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
      weight = static_cast<float>(static_cast<int>(random() % 5) - 2);  // zeros make intervals
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

TEST(ColumnOptimumTest, LiesOnTopOfWhatIsOccupiedUnderUnseenSpace) {
  // Ground, nothing seen, free.
  const ColumnOptimum optimum = optimumOf({0, 2, 3, 0, 0, 0, -1, -4});
  EXPECT_EQ(optimum.height_index, 3);
  EXPECT_TRUE(optimum.has_surface);
}

TEST(ColumnOptimumTest, KnowsThatFreeSpaceAloneIsNoSurface) {
  EXPECT_FALSE(optimumOf({0, 0, 0, -1, -4}).has_surface);
  EXPECT_EQ(optimumOf({0, 0, 0, -1, -4}).height_index, 0);
  EXPECT_FALSE(optimumOf({0, 0, 0}).has_surface);
}

TEST(ColumnOptimumTest, TakesTheStrongerOfTwoSurfaces) {
  EXPECT_EQ(optimumOf({3, -1, 1, -1}).height_index, 1);
  EXPECT_EQ(optimumOf({3, -1, 2, -1}).height_index, 3);
}

}  // namespace
}  // namespace vcharge
