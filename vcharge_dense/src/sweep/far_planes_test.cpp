#include "sweep/far_planes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge {
namespace {

using testing::allValid;
using testing::kCamera;
using testing::kLeft;
using testing::kSize;
using testing::lotScene;
using testing::makeSequence;
using testing::Sequence;

PlaneSweepOptions halvedBeyond(double distance_m) {
  PlaneSweepOptions options;
  options.half_resolution_beyond_m = distance_m;
  return options;
}

TEST(FarPlanesTest, EveryPlaneIsSweptOnceWithItsNeighbours) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -1, 0);
  const PlaneSweepOptions options = halvedBeyond(2.0);
  const auto level = std::make_shared<const SweepLevel>(kCamera, allValid(), options, s.ground);
  const FarPlanes far(level, s.ground);
  const std::vector<TilePlanes> all = allPlanes(*level, 1);
  const std::vector<TilePlanes> of_far = far.farOf(all), of_near = far.nearOf(all);
  const auto isInside = [](const std::vector<int>& slots, int plane) {
    const auto has = [&](int k) { return std::find(slots.begin(), slots.end(), k) != slots.end(); };
    return has(plane - 1) && has(plane) && has(plane + 1);
  };
  const std::vector<float>& offsets = level->planes().front().offsets;
  int num_far = 0;
  for (int plane = 1; plane + 1 < static_cast<int>(offsets.size()); ++plane) {
    const bool is_far = offsets[static_cast<size_t>(plane)] < 0.5f;
    num_far += is_far ? 1 : 0;
    EXPECT_EQ(isInside(of_far[0][0], plane), is_far) << plane;
    EXPECT_EQ(isInside(of_near[0][0], plane), !is_far) << plane;
  }
  EXPECT_GT(num_far, 5);
  EXPECT_EQ(of_near[0][1], all[0][1]);  // the ground's
  EXPECT_EQ(of_far[0][1], std::vector<int>{kGap});
}

TEST(FarPlanesTest, MeasuresFarSurfacesNearlyAsWell) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0);
  for (const bool coarse_pass : {false, true}) {
    int right[2] = {0, 0}, known[2] = {0, 0}, halved = 0;
    for (const int is_halved : {0, 1}) {
      PlaneSweepOptions options = halvedBeyond(is_halved != 0 ? 3.0 : 0.0);
      options.coarse_pass = coarse_pass;
      const PlaneSweep sweep(kCamera, allValid(), options, s.ground);
      SweepDetails details;
      const RangeMap map = sweep.sweep(s.reference, s.neighbours, &details);
      for (int y = 0; y < kSize.height; ++y) {
        for (int x = 0; x < kSize.width; ++x) {
          const double truth = s.truth.at<double>(y, x), range = map.range_m.at<float>(y, x);
          if (truth > 4.0 && std::isfinite(range)) {
            ++known[is_halved];
            right[is_halved] += std::abs(range - truth) < 0.05 * truth ? 1 : 0;
            const int plane = details.plane.at<int>(y, x);
            halved += is_halved != 0 && plane >= 0 && plane < 6 ? 1 : 0;
          }
        }
      }
    }
    EXPECT_GT(known[0], 10000);
    EXPECT_GT(halved, known[1] / 2);
    EXPECT_GT(known[1], 0.95 * known[0]);
    EXPECT_GT(right[1], 0.95 * right[0]);
  }
}

TEST(FarPlanesTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -2, 0, 2.0);
  PlaneSweepOptions options = halvedBeyond(3.0);
  options.coarse_pass = true;
  const PlaneSweep sweep(kCamera, allValid(), options, s.ground);
  testing::expectTheSameOnAnyNumberOfThreads(sweep, s);
}

TEST(FarPlanesTest, BeyondAllPlanesNothingChanges) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -2, 0, 2.0);
  std::vector<std::string> hashes;
  for (const double distance_m : {0.0, 1000.0}) {
    const PlaneSweep sweep(kCamera, allValid(), halvedBeyond(distance_m), s.ground);
    ContentHasher hasher;
    addToHash(sweep.sweep(s.reference, s.neighbours), &hasher);
    hashes.push_back(hasher.hex());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace vcharge
