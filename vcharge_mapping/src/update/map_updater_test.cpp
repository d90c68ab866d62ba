#include "vcharge_mapping/map_updater.h"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/world_drives.h"
#include "update/landmark_presence.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;

/// Every fifth landmark is on something that leaves after the first day.
bool leaves(int landmark) {
  return landmark % 5 == 0;
}

class MapUpdaterTest : public ::testing::Test {
 protected:
  /// The map of a drive on a day, which passes every second position of the world.
  std::shared_ptr<const SparseMap> driveOn(int day) const {
    return testing::driveThrough(
        *world_, std::to_string(day) + ".bag", day, RigidTransform::planar(3.0 * day, -5.0, 0.7 * day),
        [day](int i) { return i % 2 == day % 2; },
        [day](int landmark) { return day == 0 || !leaves(landmark); });
  }
  UpdatedMap update(const SparseMap& map, int day) const {
    return updateMap(map, *driveOn(day), UpdateOptions(), nullptr);
  }

  const std::shared_ptr<const SparseMap> world_ = testing::makeWorld(1);
};

TEST_F(MapUpdaterTest, RemovesWhatSeveralDrivesMissed) {
  const auto first = driveOn(0);
  const UpdatedMap second = update(*first, 1);
  EXPECT_EQ(second.report.num_removed_landmarks, 0);  // one drive is not enough
  EXPECT_GT(second.report.num_missed_landmarks, 100);
  EXPECT_GT(second.report.num_seen_landmarks, 4 * second.report.num_missed_landmarks / 2);
  const UpdatedMap third = update(*second.map, 2);
  EXPECT_GT(third.report.num_removed_landmarks, 100);
  int64_t num_left = 0;
  for (const MapLandmark& landmark : third.map->landmarks()) {
    num_left += landmark.id < first->contents().next_landmark_id && landmark.presence_log_odds < 0.0 ? 1 : 0;
  }
  EXPECT_LT(num_left, third.report.num_removed_landmarks / 4);
}

TEST_F(MapUpdaterTest, DoesNotGrowWithTheNumberOfDrives) {
  std::shared_ptr<const SparseMap> map = driveOn(0);
  size_t size_of_second = 0;
  for (int day = 1; day <= 6; ++day) {
    map = update(*map, day).map;
    if (day == 1) {
      size_of_second = map->observations().size();
    }
    EXPECT_LE(map->observations().size(), 11 * size_of_second / 10) << day;
    EXPECT_LE(map->keyframes().size(), static_cast<size_t>(testing::kNumKeyframes)) << day;
    EXPECT_EQ(map->sessions().back().name, std::to_string(day) + ".bag");
  }
}

TEST_F(MapUpdaterTest, RefusesADriveOfAnotherCarPark) {
  const auto other = testing::driveThrough(*testing::makeWorld(2), "b.bag", 1, RigidTransform(),
                                           [](int i) { return i % 2 == 0; });
  try {
    updateMap(*driveOn(0), *other, UpdateOptions(), nullptr);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no common places"));
  }
}

TEST_F(MapUpdaterTest, ImagesThatShowLittleTellLittle) {
  // The second drive sees one landmark in ten, as at night: that the others are missing means little.
  const auto night = testing::driveThrough(
      *world_, "night.bag", 1, RigidTransform(), [](int i) { return i % 2 == 1; },
      [](int landmark) { return landmark % 10 == 0; });
  const auto day = testing::driveThrough(
      *world_, "day.bag", 1, RigidTransform(), [](int i) { return i % 2 == 1; },
      [](int landmark) { return landmark % 10 != 0; });
  const auto lowestOdds = [&](const SparseMap& session) {
    MergeOptions options;
    options.min_common_over_chance = 0.0;
    const MergedMap merged = mergeSession(*driveOn(0), session, options, nullptr);
    EXPECT_TRUE(merged.report.joined);
    double sum = 0.0;
    int num_missed = 0;
    for (const PresenceEvidence& evidence : weighPresence(*merged.map, 1)) {
      if (evidence.num_missed > 0 && !evidence.is_seen) {
        sum += evidence.log_odds / evidence.num_missed;
        ++num_missed;
      }
    }
    return num_missed == 0 ? 0.0 : sum / num_missed;
  };
  const double by_day = lowestOdds(*day);
  const double by_night = lowestOdds(*night);
  EXPECT_LT(by_day, 0.0);
  EXPECT_GT(by_night, 0.4 * by_day);
}

}  // namespace
}  // namespace vcharge
