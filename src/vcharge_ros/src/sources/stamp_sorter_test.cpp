#include "vcharge_ros/stamp_sorter.h"

#include <algorithm>
#include <random>

#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::milliseconds;

TEST(StampSorterTest, RestoresTheOrderOfItemsThatAreLateByLessThanTheWindow) {
  // Item i is stamped i ms and arrives up to 99 ms late.
  std::mt19937 generator(5);
  std::vector<std::pair<int, int>> arrivals;
  for (int i = 0; i < 1000; ++i) {
    arrivals.emplace_back(i + static_cast<int>(generator() % 100), i);
  }
  std::stable_sort(arrivals.begin(), arrivals.end());
  StampSorter<int> sorter(durationFromSeconds(0.1));
  std::vector<int> released;
  const auto take = [&](Timestamp stamp, int item) {
    EXPECT_EQ(stamp, milliseconds(item));
    released.push_back(item);
  };
  size_t most_waiting = 0;
  for (size_t i = 0; i < arrivals.size(); ++i) {
    ASSERT_FALSE(sorter.isTooLate(milliseconds(arrivals[i].second)));
    sorter.push(milliseconds(arrivals[i].second), 0, arrivals[i].second);
    sorter.release(take);
    most_waiting = std::max(most_waiting, i + 1 - released.size());
  }
  sorter.flush(take);
  ASSERT_EQ(released.size(), 1000u);
  EXPECT_TRUE(std::is_sorted(released.begin(), released.end()));
  EXPECT_LE(most_waiting, 200u);  // bounded by 100 ms of window and 100 ms of lateness
}

TEST(StampSorterTest, OrdersEqualStampsByRankThenArrival) {
  StampSorter<char> sorter(durationFromSeconds(1.0));
  sorter.push(milliseconds(0), 3, 'c');
  sorter.push(milliseconds(0), 2, 'a');
  sorter.push(milliseconds(0), 2, 'b');
  sorter.push(milliseconds(0), 0, 'o');
  std::string order;
  sorter.flush([&](Timestamp, char item) { order += item; });
  EXPECT_EQ(order, "oabc");
}

TEST(StampSorterTest, SaysWhatIsTooLate) {
  StampSorter<int> sorter(durationFromSeconds(0.1));
  EXPECT_FALSE(sorter.isTooLate(milliseconds(-100000)));
  sorter.push(milliseconds(200), 0, 1);
  EXPECT_FALSE(sorter.isTooLate(milliseconds(100)));
  EXPECT_TRUE(sorter.isTooLate(milliseconds(99)));
  sorter.clear();
  EXPECT_FALSE(sorter.isTooLate(milliseconds(99)));
  EXPECT_TRUE(sorter.empty());
}

}  // namespace
}  // namespace vcharge
