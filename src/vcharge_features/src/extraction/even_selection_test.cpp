#include "extraction/even_selection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace vcharge {
namespace {

using ::testing::ElementsAre;

TEST(EvenSelectionTest, TakesFromCellsInTurnAndTheBestOfTheLastTurn) {
  // Two cells: three strong candidates on the left, two weak ones on the right.
  const std::vector<SelectionCandidate> candidates = {{{1.0F, 5.0F}, 9.0F},
                                                      {{2.0F, 5.0F}, 8.0F},
                                                      {{3.0F, 5.0F}, 7.0F},
                                                      {{15.0F, 5.0F}, 1.0F},
                                                      {{16.0F, 5.0F}, 2.0F}};
  const cv::Size size(20, 10);
  EXPECT_THAT(selectEvenly(candidates, size, 2, 1, 1), ElementsAre(0));
  EXPECT_THAT(selectEvenly(candidates, size, 2, 1, 2), ElementsAre(0, 4));
  EXPECT_THAT(selectEvenly(candidates, size, 2, 1, 3), ElementsAre(0, 1, 4));
  EXPECT_THAT(selectEvenly(candidates, size, 2, 1, 4), ElementsAre(0, 1, 3, 4));
  EXPECT_THAT(selectEvenly(candidates, size, 1, 1, 3), ElementsAre(0, 1, 2));
  EXPECT_EQ(selectEvenly(candidates, size, 2, 1, 99).size(), 5U);
  EXPECT_TRUE(selectEvenly({}, size, 2, 1, 3).empty());
}

TEST(EvenSelectionTest, TiesGoToTheFirst) {
  const std::vector<SelectionCandidate> equal(6, {{4.0F, 4.0F}, 1.0F});
  EXPECT_THAT(selectEvenly(equal, {10, 10}, 3, 3, 2), ElementsAre(0, 1));
}

TEST(EvenSelectionTest, NoCellGetsMoreThanOneAboveAnotherThatHasMoreToGive) {
  std::mt19937 generator(1);
  std::vector<SelectionCandidate> candidates;
  std::map<int, int> available, taken;
  const auto cellOf = [](const cv::Point2f& p) {
    return static_cast<int>(p.x / 100) + 5 * static_cast<int>(p.y / 100);
  };
  for (int i = 0; i < 3000; ++i) {
    // The density increases towards the origin.
    const auto draw = [&] { return static_cast<float>(std::min(generator() % 500, generator() % 500)); };
    const cv::Point2f position(draw(), draw());
    candidates.push_back({position, static_cast<float>(generator() % 50)});
    ++available[cellOf(position)];
  }
  const std::vector<int> selected = selectEvenly(candidates, {500, 500}, 5, 5, 700);
  EXPECT_EQ(selected.size(), 700U);
  EXPECT_TRUE(std::is_sorted(selected.begin(), selected.end()));
  int most = 0;
  for (const int i : selected) {
    most = std::max(most, ++taken[cellOf(candidates[i].position_px)]);
  }
  for (const auto& [cell, count] : available) {
    EXPECT_GE(taken[cell], std::min(count, most - 1));
  }
}

}  // namespace
}  // namespace vcharge
