#include "vcharge_obstacles/scrolling_grid.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr int kSize = 7;

/// A number that is unique among the cells nearby.
int markOf(int64_t x, int64_t y) {
  return static_cast<int>(1 + 1000 * (x + 100) + (y + 100));
}

void markAll(ScrollingGrid<int>* grid) {
  for (int64_t y = grid->firstY(); y < grid->firstY() + kSize; ++y) {
    for (int64_t x = grid->firstX(); x < grid->firstX() + kSize; ++x) {
      grid->at(x, y) = markOf(x, y);
    }
  }
}

TEST(ScrollingGridTest, RemainingCellsKeepTheirContentAndNewOnesAreReset) {
  const int64_t moves[][2] = {{1, 0},      {0, -1},        {-3, 2},  {6, -6},
                              {-kSize, 0}, {0, kSize + 1}, {40, 40}, {0, 0}};
  ScrollingGrid<int> grid(kSize, 0.1);
  for (const auto& move : moves) {
    markAll(&grid);
    const int64_t old_x = grid.firstX();
    const int64_t old_y = grid.firstY();
    grid.moveTo(old_x + move[0], old_y + move[1]);
    EXPECT_EQ(grid.firstX(), old_x + move[0]);
    EXPECT_EQ(grid.firstY(), old_y + move[1]);
    for (int64_t y = grid.firstY(); y < grid.firstY() + kSize; ++y) {
      for (int64_t x = grid.firstX(); x < grid.firstX() + kSize; ++x) {
        const bool stayed = x >= old_x && x < old_x + kSize && y >= old_y && y < old_y + kSize;
        EXPECT_EQ(grid.at(x, y), stayed ? markOf(x, y) : 0) << x << " " << y;
      }
    }
  }
}

TEST(ScrollingGridTest, WindowAndIndicesOnBothSidesOfTheOrigin) {
  ScrollingGrid<int> grid(kSize, 0.5);
  grid.moveTo(-3, -10);
  EXPECT_EQ(grid.indexOf(-0.01), -1);
  EXPECT_EQ(grid.indexOf(0.0), 0);
  EXPECT_EQ(grid.indexOf(1.01), 2);
  EXPECT_TRUE(grid.isInside(-3, -10));
  EXPECT_TRUE(grid.isInside(3, -4));
  EXPECT_FALSE(grid.isInside(4, -4));
  EXPECT_FALSE(grid.isInside(3, -3));
  EXPECT_FALSE(grid.isInside(-4, -10));
  grid.at(3, -4) = 5;
  grid.clear();
  EXPECT_EQ(grid.at(3, -4), 0);
  EXPECT_EQ(grid.firstX(), -3);
}

}  // namespace
}  // namespace vcharge
