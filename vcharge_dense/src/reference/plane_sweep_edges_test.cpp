// Accuracy of ranges beside a kerb with a face of 12 cm.
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

constexpr double kEdge_m = 4.0;  // y of the kerb; the left camera is at y = 1 and faces it
constexpr double kHeight_m = 0.12;

AnalyticScene kerb(uint32_t seed) {
  return AnalyticScene({{{0, kEdge_m - 50.0, 0}, {0, 0, 1}, {1e6, 50.0, 1e6}},
                        {{0, kEdge_m, 0.5 * kHeight_m}, {0, -1, 0}, {1e6, 1e6, 0.5 * kHeight_m}},
                        {{0, kEdge_m + 50.0, kHeight_m}, {0, 0, 1}, {1e6, 50.0, 1e6}}},
                       seed);
}

struct Errors {
  double known = 0.0;            // fraction of pixels with a range
  double median = 0.0;           // signed relative error of the inverse range of known pixels
  double median_absolute = 0.0;  // absolute error of all pixels; unknown ones count as infinite
};

double middleOf(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<int>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Errors of the pixels whose true point is selected.
template <class Select>
Errors errorsOf(const RangeMap& map, const Sequence& s, const Select& select) {
  std::vector<double> relative, absolute;
  const RayTable rays(kCamera, kSize, 6.283185307179586, allValid());
  for (int y = 8; y < kSize.height - 8; ++y) {
    for (int x = 100; x < 220; ++x) {
      const double range = s.truth.at<double>(y, x);
      const Eigen::Vector3d point = s.reference.world_from_camera * (range * rays.ray(x, y).cast<double>());
      if (!std::isfinite(range) || !select(point)) {
        continue;
      }
      const double error = range / map.range_m.at<float>(y, x) - 1.0;
      absolute.push_back(std::isnan(error) ? 1e9 : std::abs(error));
      if (!std::isnan(error)) {
        relative.push_back(error);
      }
    }
  }
  EXPECT_GT(absolute.size(), 100u);
  EXPECT_GT(relative.size(), 50u);
  return {static_cast<double>(relative.size()) / static_cast<double>(absolute.size()), middleOf(relative),
          middleOf(absolute)};
}
const auto kRoadBefore = [](const Eigen::Vector3d& point) {
  return point.z() < 0.005 && point.y() > kEdge_m - 0.6 && point.y() < kEdge_m - 0.1;
};
const auto kFace = [](const Eigen::Vector3d& point) {
  return point.z() > 0.02 && point.z() < kHeight_m - 0.02;
};

/// Four neighbours up to 0.8 m before and after the reference.
Sequence fourNeighbours(uint32_t seed) {
  return makeSequence(kerb(seed), kLeft, 0.4, -2, 2, 1.0);
}

/// Relative error of the inverse range at the kerb that corresponds to an error in pixels in the farthest
/// neighbour.
double relativeErrorOf(double pixels) {
  const double pixels_per_rad = kCamera.gamma1() / (1.0 + kCamera.xi()), baseline_m = 0.8;
  const double range_m = std::hypot(kEdge_m - 1.0, 0.9);
  return pixels / (pixels_per_rad * baseline_m) * range_m;
}

/// In the farthest neighbour, 64 fronto-parallel planes are 4.4 pixels apart and 256 planes 1.1 pixels.
RangeMap sweepPlanes(const Sequence& s, int num_planes, double near_spacing = 1.0) {
  PlaneSweepOptions options;
  options.aggregation = Aggregation::kReferenceSplit;
  options.pose_noise = PoseNoiseOptions::trajectory();
  options.num_planes = num_planes;
  options.near_spacing = near_spacing;
  return sweepOf(s, options);
}

TEST(PlaneSweepEdgesTest, PlanesAPixelApartFindAKerbsFaceWithinAQuarterOfAPixel) {
  for (const uint32_t seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    const Sequence s = fourNeighbours(seed);
    const Errors coarse = errorsOf(sweepPlanes(s, 64), s, kFace),
                 fine = errorsOf(sweepPlanes(s, 256), s, kFace);
    EXPECT_LE(fine.median_absolute, relativeErrorOf(0.25));
    EXPECT_LE(std::abs(fine.median), relativeErrorOf(0.1));
    EXPECT_LE(fine.median_absolute, 0.5 * coarse.median_absolute);
  }
}

TEST(PlaneSweepEdgesTest, MoreOfThePlanesFarAwayFindAKerbsFaceBetter) {
  for (const uint32_t seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    const Sequence s = fourNeighbours(seed);
    // At the kerb, the spacing of the non-uniform planes is 0.45 times that of uniform planes.
    const Errors uniform = errorsOf(sweepPlanes(s, 64), s, kFace),
                 spaced = errorsOf(sweepPlanes(s, 64, 6.0), s, kFace);
    EXPECT_LE(spaced.median_absolute, 0.7 * uniform.median_absolute);
  }
}

TEST(PlaneSweepEdgesTest, SpacingOfPlanesGrowsEvenlyBetweenTheSameEnds) {
  PlaneSweepOptions options;
  options.num_ground_planes = 0;
  options.num_planes = 33;
  options.near_spacing = 5.0;
  const std::vector<float> inverse = makePlaneFamilies(options, std::nullopt).front().inverse_distances_per_m;
  ASSERT_EQ(inverse.size(), 33u);
  EXPECT_FLOAT_EQ(inverse.front(), static_cast<float>(1.0 / options.max_distance_m));
  EXPECT_FLOAT_EQ(inverse.back(), static_cast<float>(1.0 / options.min_distance_m));
  const double second = (inverse[2] - inverse[1]) - (inverse[1] - inverse[0]);
  for (size_t i = 1; i + 1 < inverse.size(); ++i) {
    EXPECT_NEAR((inverse[i + 1] - inverse[i]) - (inverse[i] - inverse[i - 1]), second, 1e-5) << i;
  }
  // The first and last differences are half a plane inside the ends of the linear spacing.
  const double slope = 4.0 / 32.0, first = inverse[1] - inverse[0], last = inverse[32] - inverse[31];
  EXPECT_NEAR(last / first, (1.0 + 31.5 * slope) / (1.0 + 0.5 * slope), 1e-3);
  options.near_spacing = 0.5;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

TEST(PlaneSweepEdgesTest, UnevenPlanesGiveTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = fourNeighbours(4);
  PlaneSweepOptions options;
  options.near_spacing = 6.0;
  options.coarse_pass = true;
  expectTheSameOnAnyNumberOfThreads(options, s);
}

TEST(PlaneSweepEdgesTest, TheRoadBeforeAKerbIsWithinTwoMillimetresOfItsHeight) {
  for (const uint32_t seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    const Sequence s = fourNeighbours(seed);
    const Errors road = errorsOf(sweepPlanes(s, 256), s, kRoadBefore);
    // A relative range error raises or lowers the ground by the same fraction of the camera's height.
    EXPECT_LE(std::abs(road.median) * s.ground.distance_m, 0.002);
    EXPECT_GE(road.known, 0.95);
  }
}

}  // namespace
}  // namespace vcharge
