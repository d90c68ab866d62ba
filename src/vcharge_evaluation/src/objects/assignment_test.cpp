#include "objects/assignment.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace vcharge::internal {
namespace {

double costOf(const Eigen::MatrixXd& costs, const std::vector<std::optional<size_t>>& columns,
              double unassigned) {
  double sum = 0.0;
  for (size_t row = 0; row < columns.size(); ++row) {
    sum += columns[row] ? costs(static_cast<int>(row), static_cast<int>(*columns[row])) : unassigned;
  }
  return sum;
}

// Least cost over all ways to give the rows from `row` on a column that is free, or none.
double leastCost(const Eigen::MatrixXd& costs, double unassigned, int row, std::vector<bool>* taken) {
  if (row == costs.rows()) {
    return 0.0;
  }
  double least = unassigned + leastCost(costs, unassigned, row + 1, taken);
  for (int column = 0; column < costs.cols(); ++column) {
    const auto index = static_cast<size_t>(column);
    if (!(*taken)[index]) {
      (*taken)[index] = true;
      least = std::min(least, costs(row, column) + leastCost(costs, unassigned, row + 1, taken));
      (*taken)[index] = false;
    }
  }
  return least;
}

TEST(AssignmentTest, CostsAsLittleAsTheBestOfAllAssignments) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> cost(0.0, 2.0);
  std::uniform_int_distribution<int> size(0, 5);
  for (int trial = 0; trial < 300; ++trial) {
    Eigen::MatrixXd costs(size(generator), size(generator));
    for (Eigen::Index i = 0; i < costs.size(); ++i) {
      costs.data()[i] = cost(generator);
    }
    const auto columns = assignLeastCost(costs, 1.0);
    ASSERT_EQ(columns.size(), static_cast<size_t>(costs.rows()));
    std::vector<bool> taken(static_cast<size_t>(costs.cols()), false);
    for (size_t row = 0; row < columns.size(); ++row) {
      if (columns[row]) {
        EXPECT_FALSE(taken[*columns[row]]) << "each column once";
        taken[*columns[row]] = true;
        EXPECT_LE(costs(static_cast<int>(row), static_cast<int>(*columns[row])), 1.0);
      }
    }
    std::vector<bool> none(static_cast<size_t>(costs.cols()), false);
    EXPECT_NEAR(costOf(costs, columns, 1.0), leastCost(costs, 1.0, 0, &none), 1e-9);
  }
}

TEST(AssignmentTest, RowsTakeTurnsForTheLeastSum) {
  Eigen::MatrixXd costs(2, 2);
  costs << 0.1, 0.2,  // the nearest of both rows is column 0
      0.15, 0.9;
  const auto columns = assignLeastCost(costs, 1.0);
  EXPECT_EQ(columns[0], 1U);
  EXPECT_EQ(columns[1], 0U);
}

TEST(AssignmentTest, WithoutRowsOrColumnsNothingIsAssigned) {
  EXPECT_TRUE(assignLeastCost(Eigen::MatrixXd(0, 3), 1.0).empty());
  EXPECT_EQ(assignLeastCost(Eigen::MatrixXd(2, 0), 1.0), std::vector<std::optional<size_t>>(2));
}

}  // namespace
}  // namespace vcharge::internal
