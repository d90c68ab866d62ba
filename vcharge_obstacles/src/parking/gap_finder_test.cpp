#include "vcharge_obstacles/gap_finder.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

using Eigen::Vector2d;
constexpr double kCell_m = 0.1;

/// A map in which all ground within 8 m of the vehicle is free. Things that stand there are rectangles along
/// the vehicle's axes, of which only the nearest 0.2 m are seen; ground inside and behind them is unknown.
class GapFinderTest : public ::testing::Test {
 protected:
  GapFinderTest() : map_(ObstacleMap::unobserved({240, 240}, kCell_m)) {
    map_.fixed_from_vehicle = RigidTransform::planar(30.0, -20.0, 0.6);
    map_.origin_m = Vector2d(30.0, -20.0) - Vector2d(12.0, 12.0);
    forEachCell([](const Vector2d& place, int8_t* state, Vector2d* /*point*/) {
      if (std::abs(place.y()) < 8.0) {
        *state = kCellFree;
      }
    });
  }

  /// Calls function(place in the vehicle frame, state, position of the obstacle in the vehicle frame).
  template <class Function>
  void forEachCell(const Function& function) {
    const RigidTransform vehicle_from_fixed = map_.fixed_from_vehicle.inverse();
    for (int row = 0; row < map_.state.rows; ++row) {
      for (int column = 0; column < map_.state.cols; ++column) {
        const Vector2d fixed_m = map_.origin_m + kCell_m * Vector2d(column + 0.5, row + 0.5);
        const Vector2d place =
            (vehicle_from_fixed * Eigen::Vector3d(fixed_m.x(), fixed_m.y(), 0.0)).head<2>();
        Vector2d point = place;
        auto& state = map_.state.at<int8_t>(row, column);
        function(place, &state, &point);
        if (state == kCellOccupied) {
          const Eigen::Vector3d seen_m = map_.fixed_from_vehicle * Eigen::Vector3d(point.x(), point.y(), 0.0);
          map_.point_m.at<cv::Vec2f>(row, column) = {static_cast<float>(seen_m.x() - map_.origin_m.x()),
                                                     static_cast<float>(seen_m.y() - map_.origin_m.y())};
          map_.point_sigma_m.at<float>(row, column) = 0.02F;
        }
      }
    }
  }

  void put(const Vector2d& from_m, const Vector2d& to_m) {
    const double side = from_m.y() > 0.0 ? 1.0 : -1.0;
    forEachCell([&](const Vector2d& place, int8_t* state, Vector2d* point) {
      const bool is_beside = place.x() > from_m.x() && place.x() < to_m.x();
      const double near_m = side > 0.0 ? from_m.y() : -to_m.y(), far_m = side > 0.0 ? to_m.y() : -from_m.y();
      const double out_m = side * place.y();
      if (!is_beside || out_m < near_m) {
        return;
      }
      const double end_m = std::min(place.x() - from_m.x(), to_m.x() - place.x());
      const bool is_seen = out_m < far_m && (out_m < near_m + 0.2 || end_m < 0.2);
      *state = is_seen ? kCellOccupied : kCellUnobserved;
      // The faces themselves are measured, not the middles of their cells.
      if (end_m < kCell_m) {
        point->x() = place.x() < 0.5 * (from_m.x() + to_m.x()) ? from_m.x() : to_m.x();
      }
    });
  }
  std::vector<ParkingGap> find() const { return GapFinder(VehicleFootprint()).find(map_); }

  ObstacleMap map_;
};

TEST_F(GapFinderTest, FindsGapsForParallelParkingOnBothSides) {
  for (const double side : {1.0, -1.0}) {
    const auto box = [&](double from_x, double to_x, double from_out, double to_out) {
      put({from_x, side > 0.0 ? from_out : -to_out}, {to_x, side > 0.0 ? to_out : -from_out});
    };
    box(-9.0, -4.13, 1.8, 3.6);
    box(3.02, 7.0, 2.0, 3.7);
    box(-4.13, 3.02, 4.4, 4.6);  // a kerb
  }
  const std::vector<ParkingGap> gaps = find();
  ASSERT_EQ(gaps.size(), 2U);
  for (const ParkingGap& gap : gaps) {
    EXPECT_EQ(gap.kind, BayKind::kParallel);
    EXPECT_NEAR(gap.length_m, 7.15, 0.03);
    EXPECT_GT(gap.depth_m, 2.6 - 3.0 * kCell_m);
    EXPECT_LE(gap.depth_m, 2.6);
    const RigidTransform vehicle_from_fixed = map_.fixed_from_vehicle.inverse();
    Vector2d middle = Vector2d::Zero();
    double area = 0.0;
    for (size_t i = 0; i < 4; ++i) {
      const Vector2d &a = gap.corners_m[i], &b = gap.corners_m[(i + 1) % 4];
      middle += 0.25 * (vehicle_from_fixed * Eigen::Vector3d(a.x(), a.y(), 0.0)).head<2>();
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
    EXPECT_NEAR(std::abs(middle.y()), 3.1, 0.2);
    EXPECT_NEAR(middle.x(), -0.55, 0.05);
    EXPECT_NEAR(area, gap.length_m * gap.depth_m, 1e-3);  // counter-clockwise
  }
}

TEST_F(GapFinderTest, OffersNoGapThatIsTooShortOrTooShallow) {
  put({-9.0, 1.8}, {-4.0, 3.6});
  put({2.2, 1.8}, {7.0, 3.6});  // 6.2 m; 6.3 m are needed
  put({-4.0, 4.4}, {2.2, 4.6});
  EXPECT_TRUE(find().empty());
  put({3.0, -3.6}, {7.0, -1.8});
  put({-9.0, -3.6}, {-5.0, -1.8});
  put({-5.0, -3.9}, {3.0, -3.7});  // 1.9 m deep
  EXPECT_TRUE(find().empty());
}

TEST_F(GapFinderTest, OffersNoLane) {
  put({-9.0, 1.8}, {-4.0, 3.6});
  put({3.5, 1.8}, {7.0, 3.6});  // 7.5 m, open at the back
  EXPECT_TRUE(find().empty());
}

TEST_F(GapFinderTest, OffersNoGroundThatIsUnknown) {
  put({-9.0, 1.8}, {-4.0, 3.6});
  put({3.5, 1.8}, {7.0, 3.6});
  put({-4.0, 4.4}, {3.5, 4.6});
  ASSERT_EQ(find().size(), 1U);
  forEachCell([](const Vector2d& place, int8_t* state, Vector2d* /*point*/) {
    if (std::abs(place.x()) < 0.5 && place.y() > 2.5 && place.y() < 4.3) {
      *state = kCellUnobserved;
    }
  });
  EXPECT_TRUE(find().empty());
}

TEST_F(GapFinderTest, FindsGapsAtRightAngles) {
  put({-3.0, 2.5}, {-1.3, 7.0});
  put({1.45, 2.6}, {3.2, 7.0});  // 2.75 m; 2.6 m are needed
  put({5.6, 2.5}, {5.9, 7.0});   // 2.4 m behind it
  const std::vector<ParkingGap> gaps = find();
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_EQ(gaps[0].kind, BayKind::kPerpendicular);
  EXPECT_NEAR(gaps[0].length_m, 2.75, 0.03);
  EXPECT_GE(gaps[0].depth_m, 4.9);
}

TEST_F(GapFinderTest, FindsNothingInEmptyMaps) {
  EXPECT_TRUE(find().empty());  // nothing stands there
  map_.state.setTo(kCellUnobserved);
  EXPECT_TRUE(find().empty());
  map_.state.setTo(kCellOccupied);
  EXPECT_TRUE(find().empty());
  EXPECT_TRUE(GapFinder(VehicleFootprint()).find(ObstacleMap::unobserved({0, 0}, kCell_m)).empty());
  VehicleFootprint bad;
  bad.length_m = 1.0;
  EXPECT_THROW(GapFinder{bad}, std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
