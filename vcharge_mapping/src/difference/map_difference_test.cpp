#include "vcharge_mapping/map_difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/sparse_map/analytic_map.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;

TEST(MapDifferenceTest, NamesWhatAppearedVanishedAndMoved) {
  const SparseMap before(makeAnalyticMap());
  SparseMapContents contents = before.contents();
  contents.sessions[0].name = "b.bag";
  contents.landmarks[4].position_m.x() += 0.3;
  contents.landmarks[6].position_m.x() += 0.01;
  contents.landmarks[5].id = 5;
  // The last landmark goes, another comes.
  contents.landmarks.back().id = contents.next_landmark_id++;
  const SparseMap after(contents);
  const MapDifference difference = compareVersions(before, after, 0.1);
  EXPECT_EQ(difference.new_sessions, std::vector<std::string>{"b.bag"});
  EXPECT_EQ(difference.count(LandmarkChange::Kind::kAppeared), 1U);
  EXPECT_EQ(difference.count(LandmarkChange::Kind::kVanished), 1U);
  EXPECT_EQ(difference.count(LandmarkChange::Kind::kMoved), 1U);
  EXPECT_EQ(difference.num_common_landmarks, before.landmarks().size() - 1);
  EXPECT_EQ(difference.num_new_keyframes + difference.num_lost_keyframes, 0U);
  EXPECT_EQ(difference.median_move_m, 0.0);
  const std::string csv = toCsv(difference);
  EXPECT_THAT(csv, HasSubstr("moved,4,"));
  EXPECT_THAT(csv, HasSubstr(",0.3000\n"));
  EXPECT_THAT(csv, HasSubstr("vanished," + std::to_string(before.landmarks().back().id) + ","));
  EXPECT_TRUE(compareVersions(before, before, 0.0).landmarks.empty());
}

}  // namespace
}  // namespace vcharge
