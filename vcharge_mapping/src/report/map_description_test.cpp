#include "vcharge_mapping/map_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/sparse_map/analytic_map.h"

namespace vcharge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(MapDescriptionTest, TrajectoryHasThePosesOfTheKeyframes) {
  const SparseMap map(makeAnalyticMap());
  const Trajectory trajectory = trajectoryOf(map);
  ASSERT_EQ(trajectory.size(), map.keyframes().size());
  EXPECT_EQ(trajectory[7].stamp, map.keyframes()[7].stamp);
  EXPECT_EQ(trajectory[7].world_from_vehicle.translation(),
            map.keyframes()[7].map_from_vehicle.translation());
}

TEST(MapDescriptionTest, CountsTheContents) {
  const SparseMap map(makeAnalyticMap());
  const std::string text = describeMap(map, {{"bag", "drive.bag"}, {"options", "a: 1\nb: 2\n"}});
  EXPECT_THAT(text, HasSubstr("content hash  " + map.contentHash()));
  // 23 chords of 15 degrees on 20 m: 2 * 20 m * sin(7.5 degrees) * 23.
  EXPECT_THAT(text, HasSubstr("24 over 120.1 m and 11.5 s, from 1342626148.354042000 on"));
  EXPECT_THAT(text, HasSubstr("landmarks     " + std::to_string(map.landmarks().size()) + "\n"));
  EXPECT_THAT(text, HasSubstr("1 accepted, 1 rejected"));
  EXPECT_THAT(text, HasSubstr("1 rejected: outlier of the pose graph"));
  EXPECT_THAT(text, HasSubstr("distance 1.01250, true over counted turn 0.99219"));
  EXPECT_THAT(text, AllOf(HasSubstr("  bag: drive.bag\n"), HasSubstr("  options: \n    a: 1\n    b: 2\n")));
  // The circle reaches 20 m to both sides and 40 m to the left.
  EXPECT_THAT(text, HasSubstr("path      max     20.00      40.00       0.00"));
  EXPECT_THAT(describeMap(map, {}, true), AllOf(HasSubstr("0 <- 23: "), HasSubstr("none was kept")));
}

TEST(MapDescriptionTest, MeasuresTheReprojectionError) {
  SparseMapContents contents = makeAnalyticMap();
  EXPECT_LT(measureReprojection(SparseMap(contents), 0).rms_px, 1e-4);
  for (MapObservation& observation : contents.observations) {
    observation.position_px += Eigen::Vector2f(3.0F, -4.0F);
  }
  const SparseMap map(contents);
  EXPECT_NEAR(measureReprojection(map, 0).rms_px, 5.0, 1e-3);
  EXPECT_NEAR(measureReprojection(map, 1).rms_px, 5.0, 1e-3);
  EXPECT_EQ(measureReprojection(map, 0).num_observations + measureReprojection(map, 1).num_observations,
            map.observations().size());
}

TEST(MapDescriptionTest, DescribesAnEmptyMap) {
  SparseMapContents contents;
  contents.rig = makeAnalyticMap().rig;
  const SparseMap map(contents);
  EXPECT_THAT(describeMap(map, {}), AllOf(HasSubstr("keyframes     0"), HasSubstr("0 accepted, 0 rejected")));
  EXPECT_TRUE(trajectoryOf(map).empty());
}

}  // namespace
}  // namespace vcharge
