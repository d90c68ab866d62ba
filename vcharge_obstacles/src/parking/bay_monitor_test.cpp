#include "vcharge_obstacles/bay_monitor.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

using Eigen::Vector2d;
constexpr double kCell_m = 0.1;

/// A bay from (0, 3) to (2.5, 8) in a map that is turned and shifted against the frame of the obstacles,
/// which reach 10 m around the vehicle at the origin.
class BayMonitorTest : public ::testing::Test {
 protected:
  BayMonitorTest() : map_(ObstacleMap::unobserved({200, 200}, kCell_m)) {
    map_.origin_m = {-10.0, -10.0};
    const std::vector<Vector2d> corners_m{{2.5, 3.0}, {0.0, 3.0}, {0.0, 8.0}, {2.5, 8.0}};
    ParkingBay bay;
    bay.state = BayState::kOccupied;  // as it was when the bays were mapped
    for (size_t i = 0; i < corners_m.size(); ++i) {
      const Eigen::Vector3d corner_m =
          map_from_fixed_ * Eigen::Vector3d(corners_m[i].x(), corners_m[i].y(), 0.0);
      bay.corners_m[i] = corner_m.head<2>();
    }
    bays_.bays.push_back(bay);
  }

  /// Sets the cells of a rectangle.
  void set(const Vector2d& from_m, const Vector2d& to_m, int8_t state) {
    const auto cell = [](double m) { return static_cast<int>(std::lround((m + 10.0) / kCell_m)); };
    map_.state(cv::Range(cell(from_m.y()), cell(to_m.y())), cv::Range(cell(from_m.x()), cell(to_m.x())))
        .setTo(state);
  }
  /// Adds the map at 12.5 Hz.
  bool addFor(BayMonitor* monitor, double seconds) {
    bool has_changed = false;
    for (double at_s = 0.0; at_s < seconds; at_s += 0.08) {
      stamp_ = stamp_ + durationFromSeconds(0.08);
      map_.stamp = stamp_;
      has_changed |= monitor->add(map_, map_from_fixed_);
    }
    return has_changed;
  }

  const RigidTransform map_from_fixed_ = RigidTransform::planar(100.0, -50.0, 0.7);
  ObstacleMap map_;
  ParkingBays bays_;
  Timestamp stamp_ = Timestamp::fromSeconds(1000.0);
};

TEST_F(BayMonitorTest, KnowsNothingBeforeItSees) {
  BayMonitor monitor(bays_);
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kUnknown);
  set({-10.0, -10.0}, {10.0, 3.5}, kCellFree);  // the lane, and the beginning of the bay
  EXPECT_FALSE(addFor(&monitor, 2.0));
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kUnknown);
  EXPECT_FALSE(monitor.bays()[0].observed);
}

TEST_F(BayMonitorTest, TellsFreeBaysFromOccupiedOnes) {
  BayMonitor monitor(bays_);
  set({-10.0, -10.0}, {10.0, 7.0}, kCellFree);
  const Timestamp begin = stamp_ + durationFromSeconds(0.08);
  EXPECT_TRUE(addFor(&monitor, 1.0));
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kFree);
  EXPECT_EQ(*monitor.bays()[0].since, begin);
  EXPECT_EQ(*monitor.bays()[0].observed, stamp_);

  set({0.4, 4.0}, {2.1, 4.1}, kCellOccupied);  // the front of a car
  const Timestamp parked = stamp_ + durationFromSeconds(0.08);
  EXPECT_TRUE(addFor(&monitor, 1.0));
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kOccupied);
  EXPECT_EQ(*monitor.bays()[0].since, parked);
}

TEST_F(BayMonitorTest, KeepsTheStateOfBaysThatAreLeftBehind) {
  BayMonitor monitor(bays_);
  set({-10.0, -10.0}, {10.0, 7.0}, kCellFree);
  addFor(&monitor, 1.0);
  const Timestamp last = stamp_;
  map_.state.setTo(kCellUnobserved);
  EXPECT_FALSE(addFor(&monitor, 5.0));
  map_.origin_m = {1e9, 1e9};
  EXPECT_FALSE(addFor(&monitor, 1.0));
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kFree);
  EXPECT_EQ(*monitor.bays()[0].observed, last);
}

TEST_F(BayMonitorTest, IsNotMovedBySingleMapsAndCells) {
  BayMonitor monitor(bays_);
  set({-10.0, -10.0}, {10.0, 7.0}, kCellFree);
  addFor(&monitor, 1.0);
  set({0.4, 4.0}, {2.1, 4.1}, kCellOccupied);
  EXPECT_FALSE(addFor(&monitor, 0.3));  // something flashes up
  set({0.4, 4.0}, {2.1, 4.1}, kCellFree);
  EXPECT_FALSE(addFor(&monitor, 1.0));
  set({1.2, 5.0}, {1.4, 5.1}, kCellOccupied);  // noise
  EXPECT_FALSE(addFor(&monitor, 2.0));
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kFree);
}

TEST_F(BayMonitorTest, DoesNotTakeNeighboursAndWheelStopsForCars) {
  BayMonitor monitor(bays_);
  set({-10.0, -10.0}, {10.0, 7.4}, kCellFree);
  set({-0.2, 3.5}, {0.2, 7.0}, kCellOccupied);  // a neighbour over the line
  set({0.5, 7.7}, {2.0, 7.9}, kCellOccupied);   // a wheel stop
  addFor(&monitor, 1.0);
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kFree);
}

TEST_F(BayMonitorTest, ForgetsEverythingWhenTimeGoesBack) {
  BayMonitor monitor(bays_);
  set({-10.0, -10.0}, {10.0, 7.0}, kCellFree);
  addFor(&monitor, 1.0);
  stamp_ = Timestamp::fromSeconds(10.0);
  map_.state.setTo(kCellUnobserved);
  EXPECT_TRUE(addFor(&monitor, 0.1));
  EXPECT_EQ(monitor.bays()[0].bay.state, BayState::kUnknown);
  EXPECT_FALSE(monitor.bays()[0].since);
}

TEST_F(BayMonitorTest, SaysNothingOfBaysWithoutAreaOrFarAway) {
  bays_.bays[0].corners_m.fill(Vector2d(100.0, -50.0));
  ParkingBay distant = bays_.bays[0];
  distant.corners_m.fill(Vector2d(std::numeric_limits<double>::max(), 0.0));
  bays_.bays.push_back(distant);
  BayMonitor monitor(bays_);
  map_.state.setTo(kCellFree);
  EXPECT_FALSE(addFor(&monitor, 1.0));
}

}  // namespace
}  // namespace vcharge
