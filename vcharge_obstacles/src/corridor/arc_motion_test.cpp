#include "corridor/arc_motion.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "corridor/moving_polygon.h"

namespace vcharge {
namespace {

using Eigen::Vector2d;
constexpr double kNever = std::numeric_limits<double>::infinity();

TEST(ArcMotionTest, PointsMoveOnCirclesAroundTheCentreOfTheTurn) {
  const ArcMotion left(Vector2d(1.0, 2.0), Vector2d(1.0, 0.0), 0.2);
  EXPECT_NEAR((left.centre_m() - Vector2d(1.0, 7.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(left.fullTurn_m(), 10.0 * M_PI, 1e-12);
  const double quarter_m = 2.5 * M_PI;
  EXPECT_NEAR((left.moved({1.0, 2.0}, quarter_m) - Vector2d(6.0, 7.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((left.moved({1.0, 1.0}, quarter_m) - Vector2d(7.0, 7.0)).norm(), 0.0, 1e-12);
  const ArcMotion right(Vector2d(1.0, 2.0), Vector2d(1.0, 0.0), -0.2);
  EXPECT_NEAR((right.moved({1.0, 2.0}, quarter_m) - Vector2d(6.0, -3.0)).norm(), 0.0, 1e-12);
}

TEST(ArcMotionTest, TravelToABoxOnALineIsTheDistance) {
  const ArcMotion motion(Vector2d(0.0, 0.0), Vector2d(1.0, 0.0), 0.0);
  const Box2 box{{3.0, -1.0}, {4.0, 1.0}};
  EXPECT_DOUBLE_EQ(motion.travelInto({0.5, 0.9}, box), 2.5);
  EXPECT_EQ(motion.travelInto({0.5, 1.1}, box), kNever);
  EXPECT_EQ(motion.travelInto({4.5, 0.0}, box), kNever);
  EXPECT_EQ(motion.travelInto({3.5, 0.0}, box), 0.0);
  EXPECT_DOUBLE_EQ(motion.travelToBorder({3.5, 0.0}, box), 0.5);
}

TEST(ArcMotionTest, TravelToABoxOnACircleIsTheArc) {
  // Radius 5 around (0, 5): meets x = 3 where y = 5 - 4, after an angle whose sine is 0.6.
  const ArcMotion motion(Vector2d(0.0, 0.0), Vector2d(1.0, 0.0), 0.2);
  EXPECT_NEAR(motion.travelInto({0.0, 0.0}, {{3.0, 0.5}, {3.2, 1.5}}), 5.0 * std::asin(0.6), 1e-12);
  EXPECT_EQ(motion.travelInto({0.0, 0.0}, {{3.0, 1.5}, {3.2, 1.8}}), kNever);
  // A box behind is met at the end of the turn, from its far side at x = -3.2.
  EXPECT_NEAR(motion.travelInto({0.0, 0.0}, {{-3.2, 0.5}, {-3.0, 1.5}}), 5.0 * (2.0 * M_PI - std::asin(0.64)),
              1e-12);
  EXPECT_EQ(motion.travelInto({0.0, 5.0}, {{3.0, 0.5}, {3.2, 1.5}}), kNever);  // the centre rests
}

TEST(ArcMotionTest, NoPointBeforeTheFirstContactIsInTheBox) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> coordinate(-6.0, 6.0), curvature(-0.4, 0.4), size(0.1, 3.0);
  int met = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const double yaw_rad = coordinate(generator);
    const ArcMotion motion({coordinate(generator), coordinate(generator)},
                           {std::cos(yaw_rad), std::sin(yaw_rad)},
                           trial % 10 == 0 ? 0.0 : curvature(generator));
    const Vector2d point_m(coordinate(generator), coordinate(generator));
    const Vector2d min_m(coordinate(generator), coordinate(generator));
    const Box2 box{min_m, min_m + Vector2d(size(generator), size(generator))};
    const double travel_m = motion.travelInto(point_m, box);
    for (double at_m = 0.0; at_m < std::min({travel_m, motion.fullTurn_m(), 30.0}) - 1e-6; at_m += 0.01) {
      ASSERT_FALSE(box.contains(motion.moved(point_m, at_m))) << trial;
    }
    if (travel_m < kNever) {
      ++met;
      const Vector2d there_m = motion.moved(point_m, travel_m);
      EXPECT_LT((there_m - there_m.cwiseMax(box.min_m).cwiseMin(box.max_m)).norm(), 1e-7) << trial;
    }
  }
  EXPECT_GT(met, 40);
}

TEST(MovingPolygonTest, TimeToTouchIsTheGapOverTheSpeed) {
  const std::vector<Vector2d> square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const std::vector<Vector2d> wall = {{3, -5}, {4, -5}, {4, 5}, {3, 5}};
  EXPECT_DOUBLE_EQ(timeToTouch_s(square, {0.5, 0.0}, wall).value(), 4.0);
  EXPECT_DOUBLE_EQ(timeToTouch_s(square, {0.5, 7.0}, {{3, -99}, {4, -99}, {4, 99}, {3, 99}}).value(), 4.0);
  EXPECT_FALSE(timeToTouch_s(square, {-0.5, 0.0}, wall));
  EXPECT_FALSE(timeToTouch_s(square, {0.0, 0.0}, wall));
  EXPECT_FALSE(timeToTouch_s(square, {0.5, 2.0}, wall));  // passes beside it: 8 m up within 4 s
  EXPECT_EQ(timeToTouch_s({{2.5, 0}, {3.5, 0}, {3.5, 1}}, {-9.0, 0.0}, wall).value(), 0.0);
}

TEST(MovingPolygonTest, CornersAndDegeneratePolygonsAreExact) {
  const std::vector<Vector2d> diamond = {{3, 0}, {4, 1}, {3, 2}, {2, 1}};
  EXPECT_DOUBLE_EQ(timeToTouch_s({{0, 1}}, {1.0, 0.0}, diamond).value(), 2.0);
  EXPECT_NEAR(timeToTouch_s({{0, 0.5}}, {1.0, 0.0}, diamond).value(), 2.5, 1e-12);
  EXPECT_FALSE(timeToTouch_s({{0, 2.1}}, {1.0, 0.0}, diamond));
  EXPECT_NEAR(timeToTouch_s({{0, 0}, {0, 5}}, {1.0, 0.0}, diamond).value(), 2.0, 1e-12);
  EXPECT_FALSE(timeToTouch_s({}, {1.0, 0.0}, diamond));
}

}  // namespace
}  // namespace vcharge
