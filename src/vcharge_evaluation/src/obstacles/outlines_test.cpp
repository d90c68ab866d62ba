#include "vcharge_evaluation/outlines.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

const Outline kSquare = {{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}};

Outline box(double from_x, double to_x, double from_y, double to_y) {
  return {{from_x, from_y}, {to_x, from_y}, {to_x, to_y}, {from_x, to_y}};
}

TEST(OutlinesTest, DistanceFromAPolygonIsZeroInside) {
  EXPECT_EQ(distanceToPolygon({0.5, 0.5}, kSquare), 0.0);
  EXPECT_DOUBLE_EQ(distanceToPolygon({2.0, 0.5}, kSquare), 1.0);
  EXPECT_DOUBLE_EQ(distanceToPolygon({-3.0, -4.0}, kSquare), 5.0);
}

TEST(OutlinesTest, NearestPointLiesOnTheOutlineOrIsThePointInside) {
  EXPECT_EQ(nearestPoint(kSquare, Eigen::Vector2d(0.25, 0.5)), Eigen::Vector2d(0.25, 0.5));
  EXPECT_EQ(nearestPoint(kSquare, Eigen::Vector2d(0.25, -2.0)), Eigen::Vector2d(0.25, 0.0));
  EXPECT_EQ(nearestPoint(kSquare, Eigen::Vector2d(4.0, 5.0)), Eigen::Vector2d(1.0, 1.0));
}

TEST(OutlinesTest, DistanceOfTwoOutlines) {
  EXPECT_DOUBLE_EQ(distanceBetween(kSquare, box(3.0, 4.0, 0.2, 0.4)), 2.0);
  EXPECT_DOUBLE_EQ(distanceBetween(kSquare, box(4.0, 5.0, 5.0, 6.0)), 5.0);
  EXPECT_EQ(distanceBetween(kSquare, box(0.2, 0.4, 0.2, 0.4)), 0.0) << "one lies in the other";
  EXPECT_EQ(distanceBetween(box(-1.0, 2.0, 0.4, 0.6), box(0.4, 0.6, -1.0, 2.0)), 0.0) << "a cross";
}

TEST(OutlinesTest, NearestPointOfTwoOutlinesIsOnTheFirst) {
  EXPECT_EQ(nearestPoint(kSquare, box(3.0, 4.0, 0.2, 0.4)).x(), 1.0);
  EXPECT_EQ(nearestPoint(kSquare, box(4.0, 5.0, 5.0, 6.0)), Eigen::Vector2d(1.0, 1.0));
  const Outline edge_on = {{2.0, 0.5}, {3.0, 0.0}, {3.0, 1.0}};
  EXPECT_EQ(nearestPoint(kSquare, edge_on), Eigen::Vector2d(1.0, 0.5));
}

TEST(OutlinesTest, AnOutlineOfEqualCornersIsAPoint) {
  const Outline point(3, Eigen::Vector2d(2.0, 0.5));
  EXPECT_DOUBLE_EQ(distanceBetween(point, kSquare), 1.0);
  EXPECT_EQ(nearestPoint(point, kSquare), Eigen::Vector2d(2.0, 0.5));
}

TEST(OutlinesTest, TheVehicleIsARectangleInItsFrame) {
  const Outline outline = vehicleOutline(RigidTransform::planar(1.0, 2.0, 0.5 * M_PI), 3.0, -1.0, 0.8);
  ASSERT_EQ(outline.size(), 4U);
  EXPECT_TRUE(outline[0].isApprox(Eigen::Vector2d(0.2, 5.0)));
  EXPECT_TRUE(outline[2].isApprox(Eigen::Vector2d(1.8, 1.0)));
}

}  // namespace
}  // namespace vcharge
