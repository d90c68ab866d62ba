#include "vcharge_obstacles/corridor.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {
namespace {

using Eigen::Vector2d;
constexpr double kCell_m = 0.1;

/// A map around the vehicle, which points along x at the origin.
class CorridorTest : public ::testing::Test {
 protected:
  CorridorTest() { makeMap(10.0); }
  void makeMap(double half_size_m) {
    const int size = static_cast<int>(std::lround(2.0 * half_size_m / kCell_m));
    map_ = ObstacleMap::unobserved({size, size}, kCell_m);
    map_.origin_m = {-half_size_m, -half_size_m};
    map_.state.setTo(kCellFree);
    map_.age_s.setTo(0.5);
  }
  cv::Point cellAt(double x_m, double y_m) const {
    return {static_cast<int>(std::floor((x_m - map_.origin_m.x()) / kCell_m)),
            static_cast<int>(std::floor((y_m - map_.origin_m.y()) / kCell_m))};
  }
  void set(double x_m, double y_m, int8_t state) { map_.state.at<int8_t>(cellAt(x_m, y_m)) = state; }
  /// Sets all cells whose middle fulfils a condition.
  void setWhere(const std::function<bool(const Vector2d&)>& condition, int8_t state) {
    for (int row = 0; row < map_.state.rows; ++row) {
      for (int column = 0; column < map_.state.cols; ++column) {
        if (condition(map_.origin_m + kCell_m * Vector2d(column + 0.5, row + 0.5))) {
          map_.state.at<int8_t>(row, column) = state;
        }
      }
    }
  }
  Corridor find(double curvature_per_m) const {
    return CorridorFinder(vehicle_, options_).find(map_, curvature_per_m, {});
  }

  const VehicleOutline vehicle_{3.75, -0.95, 0.95};
  CorridorOptions options_;
  ObstacleMap map_;
};

TEST_F(CorridorTest, OutlineIsTheDetectors) {
  const VehicleOutline outline = VehicleFootprint().outline();
  EXPECT_EQ(outline.front_m, vehicle_.front_m);
  EXPECT_EQ(outline.rear_m, vehicle_.rear_m);
  EXPECT_EQ(outline.half_width_m, vehicle_.half_width_m);
}

TEST_F(CorridorTest, StraightDistancesAreThoseFromTheBumper) {
  set(7.05, 0.55, kCellOccupied);  // its near side is at 7.0
  set(6.05, -0.35, kCellUnobserved);
  set(-4.05, 0.05, kCellOccupied);  // its near side is at -4.0
  const Corridor corridor = find(0.0);
  EXPECT_NEAR(corridor.forward.occupied_m, 7.0 - 3.75, 1e-5);
  EXPECT_NEAR(corridor.forward.known_free_m, 6.0 - 3.75, 1e-5);
  EXPECT_NEAR(corridor.backward.occupied_m, 4.0 - 0.95, 1e-5);
  EXPECT_NEAR(corridor.backward.known_free_m, 4.0 - 0.95, 1e-5);
  EXPECT_FALSE(corridor.forward.crossing);
}

TEST_F(CorridorTest, MarginWidensTheCorridorOnBothSides) {
  for (const double side : {-1.0, 1.0}) {
    makeMap(10.0);
    set(6.05, side * 1.25, kCellOccupied);  // 1.2 to 1.3 m; the corridor ends at 1.15 m
    EXPECT_EQ(find(0.0).forward.occupied_m, std::numeric_limits<double>::infinity());
    set(6.05, side * 1.15, kCellOccupied);  // 1.1 to 1.2 m
    EXPECT_NEAR(find(0.0).forward.occupied_m, 6.0 - 3.75, 1e-5);
  }
  options_.side_margin_m = 0.0;
  EXPECT_EQ(find(0.0).forward.occupied_m, std::numeric_limits<double>::infinity());
}

TEST_F(CorridorTest, FreeMapEndsTheCorridorAtItsBorder) {
  const Corridor corridor = find(0.0);
  EXPECT_NEAR(corridor.forward.known_free_m, 10.0 - 3.75, 1e-5);
  EXPECT_NEAR(corridor.backward.known_free_m, 10.0 - 0.95, 1e-5);
  EXPECT_EQ(corridor.forward.unknown_fraction, 0.0);
  EXPECT_NEAR(corridor.forward.oldest_age_s, 0.5, 1e-6);
}

TEST_F(CorridorTest, MapSmallerThanTheHorizonCountsAsUnknownBeyond) {
  makeMap(5.0);
  const Corridor corridor = find(0.0);
  EXPECT_NEAR(corridor.forward.known_free_m, 5.0 - 3.75, 1e-5);
  // 1.25 m of 4 m are in the map, each cell of the 24 across alike.
  EXPECT_NEAR(corridor.forward.unknown_fraction, (4.0 - 1.25) / 4.0, 0.02);
  makeMap(2.0);  // smaller than the vehicle: nothing ahead is known
  EXPECT_NEAR(find(0.0).forward.known_free_m, 0.0, 0.051);  // the cell under the bumper ends 5 cm ahead
  EXPECT_EQ(find(0.0).forward.unknown_fraction, 1.0);
  EXPECT_TRUE(std::isnan(find(0.0).forward.oldest_age_s));
}

TEST_F(CorridorTest, UnknownMapHasNoFreeTravelAndNoObstacle) {
  map_.state.setTo(kCellUnobserved);
  for (const double curvature_per_m : {0.0, 0.2, -0.05}) {
    const Corridor corridor = find(curvature_per_m);
    EXPECT_LT(corridor.forward.known_free_m, 0.06);
    EXPECT_EQ(corridor.forward.free_beyond_rim_m, corridor.forward.known_free_m);
    EXPECT_EQ(corridor.forward.occupied_m, std::numeric_limits<double>::infinity());
    EXPECT_EQ(corridor.forward.unknown_fraction, 1.0);
  }
}

TEST_F(CorridorTest, WallBesideAStraightPathDoesNotStopTheVehicle) {
  // Within the margin, and along the whole side.
  setWhere([](const Vector2d& p) { return p.y() > 1.0; }, kCellOccupied);
  setWhere([](const Vector2d& p) { return p.y() > 1.0 && p.x() > 3.7; }, kCellFree);
  const Corridor corridor = find(0.0);
  EXPECT_EQ(corridor.forward.occupied_m, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(corridor.backward.occupied_m, 0.05, 0.0501);  // it goes on behind the rear bumper
}

TEST_F(CorridorTest, TurningTowardsAWallBesideTheVehicleTouchesItWithTheBody) {
  // A wall from y = 1.5 on. The body's front corner (3.75, 1.15 with margin) rises with the turn.
  setWhere([](const Vector2d& p) { return p.y() > 1.5; }, kCellOccupied);
  const double curvature_per_m = 0.2;
  const double radius_m = 1.0 / curvature_per_m;
  const Vector2d corner_m(3.75, 1.15 - radius_m);  // from the centre (0, 5)
  const double start_rad = std::atan2(corner_m.y(), corner_m.x());
  const double end_rad = std::asin((1.5 - radius_m) / corner_m.norm());
  EXPECT_NEAR(find(curvature_per_m).forward.occupied_m, radius_m * (end_rad - start_rad), 1e-4);
}

TEST_F(CorridorTest, OuterFrontCornerSweepsOutsideTheWheelsTracks) {
  // Turning left, the right front corner moves on a circle of radius 7.2 m around (0, 5); the right rear
  // wheel on one of 5.95 m. A cell between them is met by the corner alone.
  const double curvature_per_m = 0.2;
  const double corner_radius_m = std::hypot(3.75, 5.0 + 1.15);
  const double inside_rad = 0.2;  // direction of the cell from the centre, to the right of +x
  const Vector2d middle_m =
      Vector2d(0.0, 5.0) + (corner_radius_m - 0.15) * Vector2d(std::cos(inside_rad), -std::sin(inside_rad));
  set(middle_m.x(), middle_m.y(), kCellOccupied);
  const double corner_rad = std::atan2(-(5.0 + 1.15), 3.75);
  const double expected_m = 5.0 * (-inside_rad - corner_rad);
  EXPECT_NEAR(find(curvature_per_m).forward.occupied_m, expected_m, 0.15);
  makeMap(10.0);
  const Vector2d outside_m =
      Vector2d(0.0, 5.0) + (corner_radius_m + 0.15) * Vector2d(std::cos(inside_rad), -std::sin(inside_rad));
  set(outside_m.x(), outside_m.y(), kCellOccupied);
  EXPECT_EQ(find(curvature_per_m).forward.occupied_m, std::numeric_limits<double>::infinity());
}

TEST_F(CorridorTest, InnerRearSideIsSweptAndWhatLiesNearerTheCentreIsNot) {
  // Turning left with 5 m: the inner side passes at 5 - 1.15 m from the centre (0, 5).
  const auto occupiedAtRadius = [&](double radius_m) {
    makeMap(10.0);
    set(0.05 + radius_m, 5.05, kCellOccupied);
    return find(0.2).forward.occupied_m;
  };
  EXPECT_LT(occupiedAtRadius(3.95), 5.0 * 0.5 * M_PI);
  EXPECT_EQ(occupiedAtRadius(3.65), std::numeric_limits<double>::infinity());
}

TEST_F(CorridorTest, TailSwingsOutAgainstTheTurn) {
  // The right rear corner of the body (-0.95, -0.95) moves on a circle of radius sqrt(0.95^2 + 5.95^2)
  // = 6.025 m around (0, 5): as far as y = -1.025, at x = 0. With its margin it is at y = -1.15, then at
  // -1.225.
  set(-0.05, -1.25, kCellOccupied);  // y from -1.3 to -1.2
  EXPECT_LT(find(0.2).forward.occupied_m, 1.0);
  makeMap(10.0);
  set(-0.05, -1.35, kCellOccupied);
  EXPECT_GT(find(0.2).forward.occupied_m, 20.0);  // by the front, at the end of the turn
}

TEST_F(CorridorTest, FreeTurnEndsAfterTheCircumference) {
  makeMap(20.0);
  EXPECT_NEAR(find(0.2).forward.known_free_m, 10.0 * M_PI, 1e-9);
  EXPECT_NEAR(find(-0.2).backward.known_free_m, 10.0 * M_PI, 1e-9);
}

TEST_F(CorridorTest, LeftAndRightTurnsAreMirrored) {
  std::vector<Vector2d> cells_m = {{6.05, 2.05}, {3.05, 3.35}, {-5.05, 1.55}, {7.55, -0.95}};
  for (const double curvature_per_m : {0.02, 0.1, 0.2}) {
    makeMap(10.0);
    for (const Vector2d& cell_m : cells_m) {
      set(cell_m.x(), cell_m.y(), kCellOccupied);
    }
    const Corridor left = find(curvature_per_m);
    makeMap(10.0);
    for (const Vector2d& cell_m : cells_m) {
      set(cell_m.x(), -cell_m.y(), kCellOccupied);
    }
    const Corridor right = find(-curvature_per_m);
    EXPECT_NEAR(left.forward.known_free_m, right.forward.known_free_m, 1e-9);
    EXPECT_NEAR(left.backward.known_free_m, right.backward.known_free_m, 1e-9);
  }
}

TEST_F(CorridorTest, ContactIsThatOfSampledOutlines) {
  // Free travel against outlines sampled every millimetre, which needs none of the formulas.
  const std::vector<Vector2d> cells_m = {
      {6.05, 2.05}, {4.15, 3.95}, {5.55, -1.85}, {-3.05, 1.55}, {-2.05, -1.75}};
  for (const double curvature_per_m : {-0.2, -0.07, 0.0, 0.03, 0.2}) {
    for (const bool is_forward : {true, false}) {
      for (const Vector2d& cell_m : cells_m) {
        makeMap(10.0);
        set(cell_m.x(), cell_m.y(), kCellOccupied);
        const Corridor corridor = find(curvature_per_m);
        double expected_m = std::numeric_limits<double>::infinity();
        for (double s_m = 0.0; s_m < 9.0 && std::isinf(expected_m); s_m += 0.001) {
          const double travel_m = is_forward ? s_m : -s_m;
          const double yaw_rad = curvature_per_m * travel_m;
          const Vector2d at_m = curvature_per_m == 0.0
                                    ? Vector2d(travel_m, 0.0)
                                    : Vector2d(std::sin(yaw_rad), 1.0 - std::cos(yaw_rad)) / curvature_per_m;
          // Points along the cell's border, 5 mm apart.
          for (double along = -0.05; along <= 0.0501 && std::isinf(expected_m); along += 0.005) {
            for (const Vector2d& offset_m : {Vector2d(along, -0.05), Vector2d(along, 0.05),
                                             Vector2d(-0.05, along), Vector2d(0.05, along)}) {
              const Vector2d p = Eigen::Rotation2Dd(-yaw_rad) * (cell_m + offset_m - at_m);
              if (p.x() <= 3.75 && p.x() >= -0.95 && std::abs(p.y()) <= 1.15) {
                expected_m = s_m;
              }
            }
          }
        }
        const double found_m = is_forward ? corridor.forward.occupied_m : corridor.backward.occupied_m;
        if (std::isinf(expected_m)) {
          EXPECT_GT(found_m, 8.9) << curvature_per_m << " " << cell_m.transpose();
        } else {
          EXPECT_NEAR(found_m, expected_m, 0.012) << curvature_per_m << " " << cell_m.transpose();
        }
      }
    }
  }
}

TEST_F(CorridorTest, UnknownRimAroundTheBodyEndsTheKnownFreeTravelOnly) {
  const auto isInRim = [](const Vector2d& p) { return p.x() < 4.2 && p.x() > -1.4 && std::abs(p.y()) < 1.4; };
  setWhere(isInRim, kCellUnobserved);
  set(7.05, 0.05, kCellUnobserved);
  for (const double curvature_per_m : {0.0, 0.02}) {
    EXPECT_LT(find(curvature_per_m).forward.known_free_m, 0.06);
    EXPECT_NEAR(find(curvature_per_m).forward.free_beyond_rim_m, 7.0 - 3.75, 0.05);
    EXPECT_NEAR(find(curvature_per_m).forward.oldest_age_s, 0.5, 1e-6);
  }
  setWhere([](const Vector2d& p) { return p.x() > 4.4 && p.x() < 4.5; }, kCellUnobserved);  // not in the rim
  EXPECT_NEAR(find(0.0).forward.free_beyond_rim_m, 4.4 - 3.75, 1e-5);
  setWhere(isInRim, kCellOccupied);  // obstacles count everywhere
  EXPECT_LT(find(0.0).forward.free_beyond_rim_m, 0.06);
}

TEST_F(CorridorTest, PoseOfTheVehicleMovesTheCorridor) {
  const RigidTransform fixed_from_vehicle = RigidTransform::planar(100.0, -50.0, 0.5 * M_PI);
  map_.origin_m += Vector2d(100.0, -50.0);
  map_.fixed_from_vehicle = fixed_from_vehicle;
  set(100.55, -50.0 + 7.05, kCellOccupied);  // ahead of a vehicle that points along y
  EXPECT_NEAR(find(0.0).forward.occupied_m, 7.0 - 3.75, 1e-5);
  EXPECT_NEAR(find(0.0).backward.known_free_m, 10.0 - 0.95, 1e-5);
}

TEST_F(CorridorTest, OldestAgeIsThatOfTheFreeTravelOnly) {
  map_.age_s.at<float>(cellAt(5.05, 0.05)) = 3.0F;
  map_.age_s.at<float>(cellAt(8.05, 0.05)) = 9.0F;
  map_.age_s.at<float>(cellAt(5.05, 3.05)) = 9.0F;
  map_.age_s.at<float>(cellAt(1.05, 0.05)) = 9.0F;  // under the vehicle
  set(7.05, 0.05, kCellUnobserved);
  EXPECT_NEAR(find(0.0).forward.oldest_age_s, 3.0, 1e-6);
}

TEST_F(CorridorTest, UnknownFractionCountsTheFirstFourMetres) {
  setWhere([](const Vector2d& p) { return p.x() > 5.75; }, kCellUnobserved);  // 2 m ahead of the bumper
  EXPECT_NEAR(find(0.0).forward.unknown_fraction, 0.5, 0.015);
  EXPECT_EQ(find(0.0).backward.unknown_fraction, 0.0);
}

TEST_F(CorridorTest, BumpersFollowTheArc) {
  const Corridor corridor = find(0.2);
  const auto ends = corridor.bumperAt(true, 2.5 * M_PI);  // a quarter of the turn around (0, 5)
  EXPECT_NEAR((ends[0] - Vector2d(5.0 - 1.15, 5.0 + 3.75)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((ends[1] - Vector2d(5.0 + 1.15, 5.0 + 3.75)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((corridor.bumperAt(false, 0.0)[0] - Vector2d(-0.95, 1.15)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((find(0.0).bumperAt(false, 2.0)[1] - Vector2d(-2.95, -1.15)).norm(), 0.0, 1e-12);
}

TEST_F(CorridorTest, BadInputIsRefused) {
  EXPECT_THROW(find(std::nan("")), std::invalid_argument);
  EXPECT_THROW(CorridorFinder({1.0, 2.0, 0.9}, options_), std::invalid_argument);
  EXPECT_THROW(CorridorFinder({3.0, -1.0, 0.0}, options_), std::invalid_argument);
  options_.horizon_m = -1.0;
  EXPECT_THROW(CorridorFinder(vehicle_, options_), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
