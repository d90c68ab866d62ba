#include "fusion/obstacle_mapper_fixture.h"

namespace vcharge {
namespace {

TEST_F(ObstacleMapperTest, CorridorEndsAtTheBoxAhead) {
  // To the left of the direction of travel, in which motion stereo measures nothing. Its near side is at x
  // = 7.
  world_ = {{{{7.0, 0.5, 0.0}, {7.5, 1.5, 1.2}}}};
  start();
  drive(0, 81);  // 2 m
  mapper_->finish();
  const Corridor& corridor = frames_.back().corridor;
  const double bumper_m = frames_.back().map.fixed_from_vehicle.translation().x() + 3.75;
  EXPECT_NEAR(corridor.curvature_per_m, 0.0, 1e-9);
  EXPECT_NEAR(corridor.forward.occupied_m, 7.0 - bumper_m, 0.25);
  EXPECT_LE(corridor.forward.known_free_m, corridor.forward.occupied_m);
  EXPECT_EQ(corridor.backward.occupied_m, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(corridor.outline.half_width_m, 0.95 + 0.2, 1e-12);
}

TEST_F(ObstacleMapperTest, ObjectsEnterTheCorridorUntilTheyAreOld) {
  start();
  drive(0, 40);
  TrackedObject object;
  object.id = 9;
  object.velocity_m_per_s = {0.0, -1.0, 0.0};
  object.footprint_m = {{7.0, 3.15}, {7.5, 3.15}, {7.5, 3.65}, {7.0, 3.65}};  // 2 m beside the corridor
  mapper_->setObjects(stampAt(40), {object});
  drive(40, 45);
  ASSERT_EQ(frames_.back().map.stamp, stampAt(44));
  ASSERT_TRUE(frames_.back().corridor.forward.crossing);
  EXPECT_EQ(frames_.back().corridor.forward.crossing->id, 9U);
  EXPECT_NEAR(frames_.back().corridor.forward.crossing->time_s, 2.0 - 0.08, 1e-4);
  drive(45, 101);
  EXPECT_FALSE(frames_.back().corridor.forward.crossing);
}

TEST_F(ObstacleMapperTest, GroundUnderObjectsIsNotFreeUntilTheyHaveLeft) {
  start();
  drive(0, 81);
  const auto stateAt = [&](double x_m, double y_m) { return stateIn(frames_.back().map, x_m, y_m); };
  ASSERT_EQ(stateAt(4.0, 3.0), kCellFree);
  TrackedObject object;
  object.footprint_m = {{3.8, 2.8}, {4.2, 2.8}, {4.2, 3.2}, {3.8, 3.2}};
  mapper_->setObjects(stampAt(81), {object});
  drive(81, 85);
  EXPECT_EQ(stateAt(4.0, 3.0), kCellUnobserved);
  EXPECT_EQ(stateAt(4.0, 2.0), kCellFree);
  mapper_->setObjects(stampAt(85), {});
  drive(85, 89);
  EXPECT_EQ(stateAt(4.0, 3.0), kCellFree) << "the object is in no cell that is fused";
}

}  // namespace
}  // namespace vcharge
