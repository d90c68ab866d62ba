#include "vcharge_mapping/session_limit.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "testing/world_drives.h"
#include "vcharge_mapping/session_merger.h"

namespace vcharge {
namespace {

std::set<std::string> sessionsOf(const SparseMap& map) {
  std::set<std::string> names;
  for (const MapSession& session : map.sessions()) {
    names.insert(session.name);
  }
  return names;
}

class SessionLimitTest : public ::testing::Test {
 protected:
  /// The map of a drive at night, which shows half of the landmarks, or by day, which shows a part of them
  /// and others.
  std::shared_ptr<const SparseMap> drive(int number, bool is_night) const {
    return testing::driveThrough(
        *world_, (is_night ? "night " : "day ") + std::to_string(number), number, RigidTransform(),
        [number](int i) { return i % 2 == number % 2; },
        [is_night](int landmark) { return is_night ? landmark % 4 < 2 : landmark % 4 > 0; });
  }
  std::shared_ptr<const SparseMap> merge(const SparseMap& map, const SparseMap& session) const {
    MergeOptions options;
    options.min_common_over_chance = 0.0;
    return mergeSession(map, session, options, nullptr).map;
  }

  const std::shared_ptr<const SparseMap> world_ = testing::makeWorld(1);
};

TEST_F(SessionLimitTest, KeepsAMapOfFewSessionsAsItIs) {
  const auto map = merge(*drive(0, false), *drive(1, false));
  EXPECT_EQ(limitSessionsPerPlace(map, 2)->contentHash(), map->contentHash());
}

TEST_F(SessionLimitTest, KeepsTheNewestSessionAndAnotherLight) {
  auto map = merge(*drive(0, true), *drive(1, false));
  map = merge(*map, *drive(2, false));
  ASSERT_EQ(map->sessions().back().component, 0);
  const auto limited = limitSessionsPerPlace(map, 2);
  EXPECT_EQ(sessionsOf(*limited), (std::set<std::string>{"night 0", "day 2"}));
}

TEST_F(SessionLimitTest, KeepsWhatOnlyOneSessionShows) {
  const auto half = testing::driveThrough(*world_, "half", 1, RigidTransform(),
                                          [](int i) { return i % 2 == 1 && i < testing::kNumKeyframes / 2; });
  const auto map = merge(*drive(0, false), *half);
  const auto limited = limitSessionsPerPlace(map, 1);
  int num_of_first = 0;
  for (const MapKeyframe& keyframe : limited->keyframes()) {
    num_of_first += keyframe.session == 0 ? 1 : 0;
  }
  EXPECT_GE(num_of_first, testing::kNumKeyframes / 4 - 4);
  EXPECT_LE(num_of_first, testing::kNumKeyframes / 4 + 4);
}

TEST_F(SessionLimitTest, ManyMergesDoNotGrowTheMap) {
  auto map = drive(0, false);
  size_t size_of_two = 0;
  for (int i = 1; i <= 6; ++i) {
    map = limitSessionsPerPlace(merge(*map, *drive(i, false)), 2);
    size_of_two = i == 1 ? map->observations().size() : size_of_two;
    EXPECT_LE(map->observations().size(), 11 * size_of_two / 10) << i;
  }
}

}  // namespace
}  // namespace vcharge
