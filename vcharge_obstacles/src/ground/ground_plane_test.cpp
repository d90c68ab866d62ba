#include "vcharge_obstacles/ground_plane.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// Ground beside the vehicle; a fraction of the points is on a wall that stands on it.
GroundCandidates makeGround(double offset_m, double slope_x, double slope_y, double wall_fraction = 0.0) {
  GroundCandidates points;
  std::mt19937 generator(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(generator()) / 4294967296.0;
  };
  for (int i = 0; i < 4000; ++i) {
    const double x = uniform(-2.0, 6.0);
    const double y = uniform(1.2, 5.0);
    const double above = uniform(0.0, 1.0) < wall_fraction ? uniform(0.0, 0.5) : uniform(-0.01, 0.01);
    const double z = offset_m + slope_x * x + slope_y * y + above;
    points.add(Eigen::Vector3d(x, y, z).cast<float>(), 0.01F, 0.9F);
  }
  return points;
}

TEST(GroundPlaneTest, FindsPitchRollAndHeight) {
  const GroundPlane plane =
      fitGroundPlane(makeGround(-0.02, std::tan(1.0 * kDegree), std::tan(-0.7 * kDegree)), {});
  EXPECT_EQ(plane.state, GroundState::kMeasured);
  EXPECT_NEAR(plane.pitch_rad(), 1.0 * kDegree, 0.05 * kDegree);
  EXPECT_NEAR(plane.roll_rad(), 0.7 * kDegree, 0.1 * kDegree);
  EXPECT_NEAR(plane.height_m(), 0.02, 0.004);
  EXPECT_NEAR(
      plane.heightOf({4.0, 3.0, -0.02 + 4.0 * std::tan(1.0 * kDegree) - 3.0 * std::tan(0.7 * kDegree)}), 0.0,
      0.005);
}

TEST(GroundPlaneTest, WallsOnTheGroundDoNotTiltIt) {
  const GroundPlane plane = fitGroundPlane(makeGround(0.0, 0.0, 0.0, 0.4), {});
  EXPECT_EQ(plane.state, GroundState::kMeasured);
  EXPECT_NEAR(plane.pitch_rad(), 0.0, 0.15 * kDegree);
  EXPECT_LT(std::abs(plane.heightOf({3.0, 3.0, 0.0})), 0.015);
}

TEST(GroundPlaneTest, TiltOfThreeDegreesIsOutOfBounds) {
  for (const double tilt_rad : {3.0 * kDegree, -3.0 * kDegree}) {
    EXPECT_EQ(fitGroundPlane(makeGround(0.0, std::tan(tilt_rad), 0.0), {}).state, GroundState::kOutOfBounds);
    EXPECT_EQ(fitGroundPlane(makeGround(0.0, 0.0, std::tan(tilt_rad)), {}).state, GroundState::kOutOfBounds);
  }
}

TEST(GroundPlaneTest, FewPointsAreNoMeasurementAndKeepThePriorsUncertainty) {
  GroundCandidates few;
  for (int i = 0; i < 50; ++i) {
    few.add(Eigen::Vector3f(2.0F, 2.0F + 0.01F * static_cast<float>(i), 0.01F), 0.01F, 0.9F);
  }
  const GroundPlane plane = fitGroundPlane(few, {});
  EXPECT_EQ(plane.state, GroundState::kFewPoints);
  EXPECT_EQ(plane.offset_m, 0.0);
  EXPECT_GT(plane.sigmaAt_m(4.0, 0.0), 0.04);
  EXPECT_EQ(fitGroundPlane({}, {}).state, GroundState::kFewPoints);
}

TEST(GroundPlaneTest, SigmaCoversTheError) {
  const GroundPlane plane = fitGroundPlane(makeGround(0.01, 0.01, 0.0), {});
  for (const double x : {0.0, 3.0, 6.0}) {
    const double error_m = std::abs(plane.heightOf({x, 3.0, 0.01 + 0.01 * x}));
    EXPECT_LT(error_m, 3.0 * plane.sigmaAt_m(x, 3.0));
  }
}

TEST(GroundPlaneTest, OptionsNameTheField) {
  GroundPlaneOptions options;
  options.max_tilt_rad = 0.5;
  EXPECT_THROW(options.validate(), std::invalid_argument);
  options = {};
  options.max_offset_m = 0.0;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
