#include "vcharge_dense/bay_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kLine_m = 0.12;

/// A car park on level ground, seen from above, in a frame that is turned against the map's.
class CarPark {
 public:
  explicit CarPark(double turn_rad = 0.0) : map_from_park_(Eigen::Rotation2Dd(turn_rad)) {}

  /// A painted line between two places.
  void line(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) { lines_.push_back({from_m, to_m}); }
  /// Lines of `count` bays along x, from `first_m` on.
  void row(const Eigen::Vector2d& first_m, double spacing_m, const Eigen::Vector2d& depth_m, int count) {
    for (int i = 0; i <= count; ++i) {
      const Eigen::Vector2d entry_m = first_m + Eigen::Vector2d(i * spacing_m, 0.0);
      line(entry_m, entry_m + depth_m);
    }
  }
  /// A car of 4 m by 1.8 m, with unseen ground around it.
  void car(const Eigen::Vector2d& middle_m, double hidden_m = 0.1) { cars_.push_back({middle_m, hidden_m}); }
  /// Ground that is higher by a kerb.
  void kerb(const Eigen::AlignedBox2d& area) { kerbs_.push_back(area); }
  /// Cells that are not seen.
  void hide(const Eigen::AlignedBox2d& area) { hidden_.push_back(area); }
  /// Gray levels of ground and paint, and of the texture of the ground.
  void paint(double ground, double paint, double texture) {
    ground_ = ground;
    paint_ = paint;
    texture_ = texture;
  }
  /// The light at x = 15 m over that at x = -15 m.
  void light(double ratio) { light_ratio_ = ratio; }

  HeightMap map() const {
    constexpr double kHalf_m = 16.0;
    HeightMap map;
    const int size = static_cast<int>(2.0 * kHalf_m / map.cell_size_m);
    map.origin_m.setConstant(-kHalf_m);
    map.height_m.create(size, size, CV_32FC1);
    map.gray.create(size, size, CV_8UC1);
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (int row = 0; row < size; ++row) {
      for (int column = 0; column < size; ++column) {
        const Eigen::Vector2d centre_m = map_from_park_.inverse() * map.centreOf(column, row);
        const double height_m = heightAt(centre_m);
        const double light = std::pow(light_ratio_, centre_m.x() / 30.0);
        const double gray = ground_ + coverageAt(centre_m, map.cell_size_m) * (paint_ - ground_);
        map.height_m.at<float>(row, column) = static_cast<float>(height_m);
        map.gray.at<uint8_t>(row, column) =
            cv::saturate_cast<uint8_t>(light * (height_m > 0.5 ? 200.0 : gray) + texture_ * noise(random));
      }
    }
    return map;
  }

  Eigen::Vector2d inMap(const Eigen::Vector2d& park_m) const { return map_from_park_ * park_m; }

 private:
  struct Line {
    Eigen::Vector2d from_m, to_m;
  };
  struct Car {
    Eigen::Vector2d middle_m;
    double hidden_m;
  };

  double heightAt(const Eigen::Vector2d& at_m) const {
    for (const Car& car : cars_) {
      const Eigen::Vector2d from = (at_m - car.middle_m).cwiseAbs();
      if (from.x() < 0.9 && from.y() < 2.0) {
        return 1.2;
      }
      if (from.x() < 0.9 + car.hidden_m && from.y() < 2.0 + car.hidden_m) {
        return std::numeric_limits<double>::quiet_NaN();
      }
    }
    for (const Eigen::AlignedBox2d& area : hidden_) {
      if (area.contains(at_m)) {
        return std::numeric_limits<double>::quiet_NaN();
      }
    }
    return std::any_of(kerbs_.begin(), kerbs_.end(), [&](const auto& kerb) { return kerb.contains(at_m); })
               ? 0.08
               : 0.0;
  }

  double coverageAt(const Eigen::Vector2d& centre_m, double cell_m) const {
    double covered = 0.0;
    for (const Line& line : lines_) {
      const Eigen::Vector2d along = (line.to_m - line.from_m).normalized();
      const Eigen::Vector2d from = centre_m - line.from_m;
      const double at_m = along.dot(from), beside_m = std::abs(along.x() * from.y() - along.y() * from.x());
      if (at_m > 0.0 && at_m < (line.to_m - line.from_m).norm()) {
        covered = std::max(covered, std::clamp((0.5 * (kLine_m + cell_m) - beside_m) / cell_m, 0.0, 1.0));
      }
    }
    return covered;
  }

  Eigen::Rotation2Dd map_from_park_;
  std::vector<Line> lines_;
  std::vector<Car> cars_;
  std::vector<Eigen::AlignedBox2d> hidden_, kerbs_;
  double ground_ = 90.0, paint_ = 170.0, texture_ = 4.0, light_ratio_ = 1.0;
};

/// The bay whose centre is nearest to a place of the park. Null if none is within a metre.
const ParkingBay* bayAt(const ParkingBays& bays, const CarPark& park, const Eigen::Vector2d& centre_m) {
  for (const ParkingBay& bay : bays.bays) {
    if ((bay.centre_m() - park.inMap(centre_m)).norm() < 1.0) {
      return &bay;
    }
  }
  return nullptr;
}

void expectCorners(const ParkingBay& bay, const CarPark& park,
                   const std::array<Eigen::Vector2d, 4>& corners_m, double tolerance_m) {
  for (size_t i = 0; i < corners_m.size(); ++i) {
    EXPECT_LT((bay.corners_m[i] - park.inMap(corners_m[i])).norm(), tolerance_m) << "corner " << i;
  }
}

TEST(BayFinderTest, FindsPerpendicularBaysAtAnyAngleAndWhatIsInThem) {
  for (const double turn_rad : {0.0, 0.4, 1.2, 2.5}) {
    CarPark park(turn_rad);
    park.row({-6.5, 2.0}, 2.6, {0.0, 4.8}, 5);
    park.row({-6.5, -4.0}, 2.6, {0.0, -4.8}, 5);
    park.car({0.0, 4.4});
    park.hide({Eigen::Vector2d(3.95, 2.1), Eigen::Vector2d(6.4, 6.7)});
    park.hide({Eigen::Vector2d(-16.0, 7.5), Eigen::Vector2d(16.0, 16.0)});  // the lane is between the rows
    park.hide({Eigen::Vector2d(-16.0, -16.0), Eigen::Vector2d(16.0, -9.5)});
    const ParkingBays bays = findBays(park.map());
    ASSERT_EQ(bays.bays.size(), 10U) << turn_rad;
    for (int i = 0; i < 5; ++i) {
      const double left = -6.5 + 2.6 * i, right = left + 2.6;
      const ParkingBay* north = bayAt(bays, park, {left + 1.3, 4.4});
      const ParkingBay* south = bayAt(bays, park, {left + 1.3, -6.4});
      ASSERT_TRUE(north != nullptr && south != nullptr);
      EXPECT_EQ(north->kind, BayKind::kPerpendicular);
      EXPECT_NE(north->row, south->row);
      EXPECT_EQ(south->state, BayState::kFree);
      EXPECT_EQ(north->state, i == 2 ? BayState::kOccupied : i == 4 ? BayState::kUnknown : BayState::kFree);
      expectCorners(*south, park, {{{right, -4.0}, {left, -4.0}, {left, -8.8}, {right, -8.8}}}, 0.08);
    }
  }
}

TEST(BayFinderTest, FindsAngledAndParallelBays) {
  CarPark park(0.3);
  const Eigen::Vector2d depth_m(2.5, 4.33);
  park.row({-12.0, 1.0}, 3.0, depth_m, 5);
  park.row({-12.0, -4.0}, 6.2, {0.0, -2.3}, 3);
  park.hide({Eigen::Vector2d(-16.0, 6.5), Eigen::Vector2d(16.0, 16.0)});  // the lane is between the rows
  park.line({-12.0, -4.0}, {6.6, -4.0});
  park.line({-12.0, -6.3}, {6.6, -6.3});
  const ParkingBays bays = findBays(park.map());
  EXPECT_EQ(bays.bays.size(), 8U);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector2d left(-12.0 + 3.0 * i, 1.0), right = left + Eigen::Vector2d(3.0, 0.0);
    const ParkingBay* bay = bayAt(bays, park, 0.5 * (left + right + depth_m));
    ASSERT_TRUE(bay != nullptr);
    EXPECT_EQ(bay->kind, BayKind::kAngled);
    expectCorners(*bay, park, {{left, right, right + depth_m, left + depth_m}}, 0.1);
  }
  for (int i = 0; i < 3; ++i) {
    const ParkingBay* bay = bayAt(bays, park, {-8.9 + 6.2 * i, -5.15});
    ASSERT_TRUE(bay != nullptr);
    EXPECT_EQ(bay->kind, BayKind::kParallel);
  }
}

TEST(BayFinderTest, InfersLinesThatCarsHideAndEndsARowAtBareGround) {
  CarPark park;
  park.row({-13.0, 2.0}, 2.6, {0.0, 4.8}, 4);  // up to -2.6, then bare ground of two bays
  park.row({2.6, 2.0}, 2.6, {0.0, 4.8}, 4);
  park.car({-8.9, 4.4}, 0.3);  // the line between them is hidden
  park.car({-6.7, 4.4}, 0.3);
  const ParkingBays bays = findBays(park.map());
  EXPECT_EQ(bays.bays.size(), 8U);
  for (int i = 0; i < 4; ++i) {
    const ParkingBay* bay = bayAt(bays, park, {-11.7 + 2.6 * i, 4.4});
    ASSERT_TRUE(bay != nullptr) << i;
    EXPECT_EQ(bay->state == BayState::kOccupied, i == 1 || i == 2);
    EXPECT_EQ(bay->confidence < 1.0, i == 1 || i == 2) << "the line between them is inferred";
  }
}

TEST(BayFinderTest, FindsWornPaintInUnevenLight) {
  CarPark park(0.2);
  park.paint(60.0, 75.0, 3.0);
  park.light(3.0);
  park.row({-7.8, 2.0}, 2.6, {0.0, 4.8}, 6);
  const ParkingBays bays = findBays(park.map());
  EXPECT_EQ(bays.bays.size(), 6U);
}

TEST(BayFinderTest, EndsBaysAtTheKerb) {
  CarPark park(0.3);
  park.row({-6.5, 2.0}, 2.6, {0.0, 4.2}, 5);
  park.kerb({Eigen::Vector2d(-16.0, 6.2), Eigen::Vector2d(16.0, 16.0)});
  park.car({0.0, 4.1});
  park.hide({Eigen::Vector2d(1.5, 3.0), Eigen::Vector2d(6.4, 6.7)});
  const ParkingBays bays = findBays(park.map());
  ASSERT_EQ(bays.bays.size(), 5U);
  for (const ParkingBay& bay : bays.bays) {
    EXPECT_NEAR((bay.corners_m[3] - bay.corners_m[0]).norm(), 4.2, 0.12);
    EXPECT_LT(bay.end_sigma_m, 0.2);
  }
}

TEST(BayFinderTest, FindsNoBaysInOtherMarkingsOrWithoutAny) {
  CarPark markings;
  for (double x = -14.0; x < 12.0; x += 4.7) {
    markings.line({x, 0.0}, {x + 2.0, 0.0});  // dashes of a lane
  }
  for (double y = -14.0; y < 14.0; y += 1.0) {
    markings.line({10.0, y}, {12.0, y + 1.5});  // hatching
  }
  markings.line({-8.0, 5.0}, {-5.0, 5.0});  // an arrow
  markings.line({-5.0, 5.0}, {-5.6, 5.5});
  markings.line({-5.0, 5.0}, {-5.6, 4.5});
  markings.line({0.0, 6.0}, {0.0, 11.0});  // two lines alone
  markings.line({2.6, 6.0}, {2.6, 11.0});
  EXPECT_TRUE(findBays(markings.map()).bays.empty());

  CarPark bare;
  bare.paint(90.0, 90.0, 12.0);
  EXPECT_TRUE(findBays(bare.map()).bays.empty());

  CarPark snow;
  snow.paint(250.0, 255.0, 6.0);
  snow.row({-7.8, 2.0}, 2.6, {0.0, 4.8}, 6);
  EXPECT_TRUE(findBays(snow.map()).bays.empty());

  HeightMap unseen = bare.map();
  unseen.height_m.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(findBays(unseen).bays.empty());
}

TEST(BayFinderTest, RefusesMapsInWhichLinesCannotBeSeen) {
  HeightMap map = CarPark().map();
  map.cell_size_m = 0.2;
  EXPECT_THROW(findBays(map), InputError);
  map = CarPark().map();
  map.gray = cv::Mat();
  EXPECT_THROW(findBays(map), InputError);
}

}  // namespace
}  // namespace vcharge
