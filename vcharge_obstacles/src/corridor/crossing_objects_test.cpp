#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_obstacles/corridor.h"

namespace vcharge {
namespace {

/// A square object of 0.6 m.
TrackedObject objectAt(uint32_t id, double x_m, double y_m, double vx_m_per_s, double vy_m_per_s) {
  TrackedObject object;
  object.id = id;
  object.velocity_m_per_s = {vx_m_per_s, vy_m_per_s, 0.0};
  object.footprint_m = {
      {x_m - 0.3, y_m - 0.3}, {x_m + 0.3, y_m - 0.3}, {x_m + 0.3, y_m + 0.3}, {x_m - 0.3, y_m + 0.3}};
  return object;
}

/// The corridor of a straight path reaches from y = -1.15 to 1.15 and up to 5 m ahead of the bumper at 3.75.
class CrossingObjectsTest : public ::testing::Test {
 protected:
  std::optional<CrossingObject> find(const std::vector<TrackedObject>& objects, double curvature_per_m = 0.0,
                                     bool is_forward = true) const {
    return CorridorFinder({3.75, -0.95, 0.95}, {}).findCrossing(pose_, curvature_per_m, is_forward, objects);
  }
  RigidTransform pose_;
};

TEST_F(CrossingObjectsTest, TimeIsTheGapOverTheSpeed) {
  const auto crossing = find({objectAt(7, 6.05, 4.45, 0.0, -1.5)});  // its side is at y = 4.15
  ASSERT_TRUE(crossing);
  EXPECT_EQ(crossing->id, 7U);
  EXPECT_NEAR(crossing->time_s, 3.0 / 1.5, 1e-4);
  EXPECT_NEAR(crossing->travel_m, 5.75 - 3.75, 0.11);  // rounded down
  EXPECT_LE(crossing->travel_m, 2.0 + 1e-9);
}

TEST_F(CrossingObjectsTest, TheFirstToTouchCounts) {
  const auto crossing = find({objectAt(1, 6.0, 4.45, 0.0, -1.0), objectAt(2, 8.0, -3.45, 0.0, 1.0),
                              objectAt(3, 5.0, 9.0, 0.0, -1.0)});
  ASSERT_TRUE(crossing);
  EXPECT_EQ(crossing->id, 2U);
  EXPECT_NEAR(crossing->time_s, 2.0, 1e-4);
}

TEST_F(CrossingObjectsTest, ObjectsThatDoNotCrossWithinTheTimeAreAbsent) {
  EXPECT_FALSE(find({}));
  EXPECT_FALSE(find({objectAt(1, 6.0, 4.45, 0.0, 1.0)}));    // goes away
  EXPECT_FALSE(find({objectAt(1, 6.0, 4.45, 0.0, 0.0)}));    // stands beside the corridor
  EXPECT_FALSE(find({objectAt(1, 6.0, 4.45, 0.0, -0.55)}));  // arrives after 5.5 s
  EXPECT_TRUE(find({objectAt(1, 6.0, 4.45, 0.0, -0.65)}));
  EXPECT_FALSE(find({objectAt(1, 9.5, 4.45, 0.0, -1.5)}));  // beyond the horizon
  EXPECT_FALSE(find({objectAt(1, 6.0, 4.45, 5.0, -1.5)}));  // has passed the horizon before
}

TEST_F(CrossingObjectsTest, ObjectThatStandsInTheCorridorTouchesNow) {
  const auto crossing = find({objectAt(4, 6.05, 0.0, 0.0, 0.0)});
  ASSERT_TRUE(crossing);
  EXPECT_EQ(crossing->time_s, 0.0);
  EXPECT_NEAR(crossing->travel_m, 1.95, 0.06);
}

TEST_F(CrossingObjectsTest, ObjectThatFollowsTheVehicleDoesNotCross) {
  const TrackedObject follower = objectAt(5, -5.0, 0.0, 2.0, 0.0);
  EXPECT_FALSE(find({follower}));
  const auto backward = find({follower}, 0.0, false);
  ASSERT_TRUE(backward);
  EXPECT_EQ(backward->time_s, 0.0);  // it is in the corridor behind the vehicle
  EXPECT_FALSE(find({objectAt(6, 9.0, 0.0, -2.0, 0.0)}, 0.0, false));
  EXPECT_TRUE(find({objectAt(6, 1.0, 3.0, 0.0, -1.0)}));  // walks into the vehicle's side
}

TEST_F(CrossingObjectsTest, TurnsLeadToOtherObjects) {
  // A quarter of a turn of 5 m around (0, 5) leads past (5, 5); the horizon is 5 m of it.
  const TrackedObject left = objectAt(8, 4.5, 4.5, 0.0, 0.0);
  const TrackedObject right = objectAt(9, 4.5, -4.5, 0.0, 0.0);
  EXPECT_EQ(find({left, right}, 0.2)->id, 8U);
  EXPECT_EQ(find({left, right}, -0.2)->id, 9U);
  EXPECT_FALSE(find({left, right}));
}

TEST_F(CrossingObjectsTest, PoseOfTheVehicleMovesTheCorridor) {
  pose_ = RigidTransform::planar(1000.0, 2000.0, 0.5 * M_PI);
  const auto crossing = find({objectAt(7, 1004.45, 2006.05, -1.5, 0.0)});
  ASSERT_TRUE(crossing);
  EXPECT_NEAR(crossing->time_s, 2.0, 1e-4);
}

TEST_F(CrossingObjectsTest, HostileObjectsAreIgnored) {
  TrackedObject object = objectAt(1, 6.0, 0.0, 0.0, 0.0);
  object.velocity_m_per_s.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(find({object}));
  object = objectAt(1, 6.0, 0.0, 0.0, 0.0);
  object.footprint_m[2].y() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(find({object}));
  object.footprint_m.clear();
  EXPECT_FALSE(find({object}));
  object.footprint_m = {{6.0, 0.0}};  // a point
  EXPECT_TRUE(find({object}));
}

TEST(MovedObjectsTest, AnotherFrameTurnsAndShiftsAll) {
  TrackedObject object;
  object.frame_from_object = RigidTransform::planar(2.0, 0.0, 0.1);
  object.velocity_m_per_s = {1.0, 0.0, 0.0};
  object.covariance(0, 0) = 4.0;
  object.footprint_m = {{2.0, 0.5}};
  const std::vector<TrackedObject> turned =
      transformed(RigidTransform::planar(10.0, 0.0, M_PI / 2.0), std::vector<TrackedObject>{object});
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_TRUE(turned[0].frame_from_object.translation().isApprox(Eigen::Vector3d(10.0, 2.0, 0.0), 1e-12));
  EXPECT_TRUE(turned[0].velocity_m_per_s.isApprox(Eigen::Vector3d(0.0, 1.0, 0.0), 1e-12));
  EXPECT_NEAR(turned[0].covariance(1, 1), 4.0, 1e-12);
  EXPECT_TRUE(turned[0].footprint_m[0].isApprox(Eigen::Vector2d(9.5, 2.0), 1e-12));
}

}  // namespace
}  // namespace vcharge
