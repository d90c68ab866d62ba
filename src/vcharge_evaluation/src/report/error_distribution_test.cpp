#include "vcharge_evaluation/error_distribution.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(ErrorDistributionTest, PercentilesAreLinearBetweenRanks) {
  const std::vector<double> sorted = {0.0, 1.0, 2.0, 3.0, 4.0};
  EXPECT_DOUBLE_EQ(percentileOfSorted(sorted, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(percentileOfSorted(sorted, 50.0), 2.0);
  EXPECT_DOUBLE_EQ(percentileOfSorted(sorted, 62.5), 2.5);
  EXPECT_DOUBLE_EQ(percentileOfSorted(sorted, 100.0), 4.0);
  EXPECT_THROW(percentileOfSorted({}, 50.0), std::logic_error);
}

TEST(ErrorDistributionTest, SummarizesInAnyOrder) {
  const ErrorDistribution distribution = summarize({3.0, 1.0, 2.0});
  EXPECT_EQ(distribution.count, 3U);
  EXPECT_DOUBLE_EQ(distribution.mean, 2.0);
  EXPECT_DOUBLE_EQ(distribution.root_mean_square, std::sqrt(14.0 / 3.0));
  EXPECT_DOUBLE_EQ(distribution.percentile_50, 2.0);
  EXPECT_DOUBLE_EQ(distribution.max, 3.0);
  EXPECT_EQ(summarize({}).count, 0U);
}

}  // namespace
}  // namespace vcharge
