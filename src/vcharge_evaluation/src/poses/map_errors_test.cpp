#include "vcharge_evaluation/map_errors.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kStep_m = 1.0;
constexpr int kLane = 20;  // keyframes in a lane

Timestamp at(int i) {
  return Timestamp::fromNanoseconds(1'000'000'000'000LL + 500'000'000LL * i);
}

/// Three passes of a lane of 20 m: keyframe k of the first pass is at (k, 0), of the second at (19 - k, 1) in
/// the opposite heading, of the third at (k, -1).
Trajectory thereBackAndThere() {
  Trajectory truth;
  for (int i = 0; i < 3 * kLane; ++i) {
    const int pass = i / kLane, along = i % kLane;
    const RigidTransform pose = pass == 0   ? RigidTransform::planar(kStep_m * along, 0.0, 0.0)
                                : pass == 1 ? RigidTransform::planar(kStep_m * (kLane - 1 - along), 1.0, 3.1)
                                            : RigidTransform::planar(kStep_m * along, -1.0, 0.05);
    truth.push_back({at(i), pose});
  }
  return truth;
}

CameraRig makeRig() {
  CameraRig rig;
  PinholeCamera::Parameters parameters;
  parameters << 50.0, 50.0, 31.5, 19.5, 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{"front", "camera_front_optical", cv::Size(64, 40), PinholeCamera(parameters)};
  camera.vehicle_from_camera = RigidTransform();
  rig.cameras.push_back(camera);
  return rig;
}

class MapErrorsTest : public ::testing::Test {
 protected:
  MapErrorsTest() : truth_(thereBackAndThere()) {
    contents_.rig = makeRig();
    for (const StampedTransform& pose : truth_) {
      contents_.keyframes.push_back({pose.stamp, map_from_truth_ * pose.world_from_vehicle});
    }
  }

  /// Adds an edge with an error in the frame of the second keyframe.
  void addEdge(int first, int second, const RigidTransform& error, const std::string& reason = "") {
    const RigidTransform first_from_second =
        truth_[first].world_from_vehicle.inverse() * truth_[second].world_from_vehicle;
    contents_.loop_edges.push_back({first, second, first_from_second * error, 30, reason.empty(), reason});
  }

  MapErrors evaluate() { return evaluateMap(SparseMap(contents_), truth_); }

  const RigidTransform map_from_truth_ = RigidTransform::planar(3.0, -2.0, 0.7);
  Trajectory truth_;
  SparseMapContents contents_;
};

TEST_F(MapErrorsTest, RigidlyMovedMapHasNoError) {
  const MapErrors errors = evaluate();
  EXPECT_LE(errors.keyframes.position_m.max, 1e-9);
  EXPECT_NEAR(errors.scale_error, 0.0, 1e-12);
  EXPECT_LE((errors.truth_from_map.matrix() - map_from_truth_.inverse().matrix()).norm(), 1e-9);
}

TEST_F(MapErrorsTest, ScaleErrorOfALargerMapIsFound) {
  for (MapKeyframe& keyframe : contents_.keyframes) {
    keyframe.map_from_vehicle =
        RigidTransform(keyframe.map_from_vehicle.rotation(), 1.01 * keyframe.map_from_vehicle.translation());
  }
  EXPECT_NEAR(evaluate().scale_error, 0.01, 1e-9);
}

TEST_F(MapErrorsTest, EdgesBeyondTheBoundsAreWrong) {
  addEdge(5, 45, RigidTransform::planar(0.29, 0.0, 0.0));
  addEdge(6, 46, RigidTransform::planar(0.0, 0.31, 0.0));
  addEdge(7, 47, RigidTransform::planar(0.0, 0.0, 0.051));
  addEdge(8, 48, RigidTransform::planar(0.0, 0.0, -0.054));
  addEdge(9, 49, RigidTransform(), "too uncertain");
  addEdge(9, 50, RigidTransform::planar(5.0, 0.0, 0.0), "too uncertain");
  const MapErrors errors = evaluate();
  EXPECT_EQ(errors.num_accepted, 4);
  EXPECT_EQ(errors.num_wrong, 2);
  EXPECT_TRUE(errors.edges[0].is_right && errors.edges[2].is_right);
  EXPECT_FALSE(errors.edges[1].is_right || errors.edges[3].is_right);
  EXPECT_NEAR(errors.accepted_m.max, 0.31, 1e-9);
  EXPECT_NEAR(errors.accepted_rad.max, 0.054, 1e-9);
  ASSERT_EQ(errors.rejected.size(), 1U);
  EXPECT_EQ(errors.rejected.at("too uncertain").num_edges, 2);
  EXPECT_EQ(errors.rejected.at("too uncertain").num_right, 1);
}

TEST_F(MapErrorsTest, PositionsPassedBeforeAreCountedByHeading) {
  // The second pass is opposite to the first. The vehicle has driven about 2 j + 2 m since it was near
  // keyframe j of the second pass, so that the first few have no pass within 3 m that is more than 10 m ago.
  // The third pass has both.
  const MapErrors none = evaluate();
  EXPECT_EQ(none.revisits.num_found, 0);
  EXPECT_EQ(none.same.num_keyframes, kLane);
  int expected = 0;  // keyframes of the second pass, by that formula
  for (int j = 0; j < kLane; ++j) {
    bool any = false;
    for (int k = 0; k < kLane; ++k) {
      const double distance_m = std::hypot(kLane - 1 - j - k, 1.0);
      const double travel_m = (kLane - 1 - k) + 1.0 + j;
      any |= distance_m < 3.0 && travel_m > 10.0;
    }
    expected += any ? 1 : 0;
  }
  EXPECT_EQ(none.only_opposite.num_keyframes, expected);
  EXPECT_EQ(none.revisits.num_keyframes, expected + kLane);
  EXPECT_FALSE(none.is_revisit[3]);
  EXPECT_TRUE(none.is_revisit[kLane + 15]);

  addEdge(3, kLane + 16, RigidTransform());                                  // opposite
  addEdge(5, 2 * kLane + 5, RigidTransform());                               // same
  addEdge(kLane + 12, 2 * kLane + 7, RigidTransform());                      // opposite, to the second pass
  addEdge(9, 2 * kLane + 9, RigidTransform::planar(1.0, 0.0, 0.0));          // wrong
  addEdge(10, 2 * kLane + 10, RigidTransform(), "too few landmarks agree");  // not accepted
  const MapErrors errors = evaluate();
  EXPECT_EQ(errors.revisits.num_found, 3);
  EXPECT_EQ(errors.same.num_found, 1);
  EXPECT_EQ(errors.opposite.num_found, 2);
  EXPECT_EQ(errors.only_opposite.num_found, 1);
  EXPECT_TRUE(errors.is_found[2 * kLane + 7]);
  EXPECT_FALSE(errors.is_found[2 * kLane + 9] || errors.is_found[2 * kLane + 10]);
}

TEST_F(MapErrorsTest, KeyframesOutsideTheTruthAreCountedAndNotJudged) {
  addEdge(0, 3 * kLane - 1, RigidTransform());
  truth_.resize(2 * kLane + 11);
  const MapErrors errors = evaluate();
  EXPECT_EQ(errors.num_keyframes_without_truth, kLane - 11);
  EXPECT_EQ(errors.num_accepted, 0);
  EXPECT_FALSE(errors.edges[0].has_truth);
  EXPECT_EQ(errors.same.num_keyframes, 11);
  truth_.resize(2);
  EXPECT_THROW(evaluate(), InputError);
}

TEST(MapErrorOptionsTest, NamesABadField) {
  MapErrorOptions options;
  options.opposite_rad = 4.0;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
