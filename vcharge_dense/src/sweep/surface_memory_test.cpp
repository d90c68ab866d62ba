#include "sweep/surface_memory.h"

#include <cmath>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"

namespace vcharge {
namespace {

constexpr int kBorder = 8;

/// A sweep of a lot from the left camera, and what is remembered from the image before.
struct Remembering {
  AnalyticScene scene;
  Sequence sequence;
  PlaneSweepOptions options;
  RememberedRanges memory;

  explicit Remembering(uint32_t seed) : scene(lotScene(seed)) {
    sequence = makeSequence(scene, kLeft, 0.2, -4, 0, 2.0);
    options.coarse_pass = true;
    memory.world_from_camera = sequence.neighbours.back().world_from_camera;
    scene.range(kCamera, kSize, memory.world_from_camera).convertTo(memory.range_m, CV_32F);
  }
  RangeMap sweep(const RememberedRanges* remembered) const {
    const PlaneSweep plane_sweep(kCamera, allValid(), options, sequence.ground);
    return plane_sweep.sweep(sequence.reference, sequence.neighbours, nullptr, remembered);
  }
  int right(const RangeMap& map) const { return countRight(map, sequence.truth, 0.05, kBorder); }
};

TEST(SurfaceMemoryTest, APredictionGivesAtLeastAsManyRightRanges) {
  for (uint32_t seed = 60; seed < 63; ++seed) {
    const Remembering test(seed);
    const RangeMap without = test.sweep(nullptr), with = test.sweep(&test.memory);
    EXPECT_GE(test.right(with), 0.99 * test.right(without)) << seed;
    const double precision = static_cast<double>(test.right(without)) / countKnown(without);
    EXPECT_GE(test.right(with), (precision - 0.005) * countKnown(with)) << seed;
  }
}

TEST(SurfaceMemoryTest, AWrongPredictionDiesWithinTwoImages) {
  for (const double factor : {0.5, 0.8, 1.3}) {
    Remembering test(64);
    const RangeMap without = test.sweep(nullptr);
    const int wrong_without = countKnown(without) - test.right(without);
    test.memory.range_m *= factor;
    for (const double least : {0.9, 0.99}) {
      const RangeMap with = test.sweep(&test.memory);
      EXPECT_GE(test.right(with), least * test.right(without)) << factor;
      EXPECT_LE(countKnown(with) - test.right(with), wrong_without + 0.01 * kSize.area()) << factor;
      test.memory = {with.range_m, test.sequence.reference.world_from_camera, 1};
    }
  }
}

TEST(SurfaceMemoryTest, WhatIsUnknownIsSweptAndEveryTileInTurn) {
  Remembering test(65);
  const RangeMap without = test.sweep(nullptr);
  test.memory.range_m.setTo(std::nanf(""));
  EXPECT_EQ(hashOf(test.sweep(&test.memory)), hashOf(without));
  // A phase sweeps its own tiles; without neighbours nothing is known, whatever is remembered.
  Remembering other(65);
  const RangeMap first = other.sweep(&other.memory);
  other.memory.num_sweeps = 1;
  EXPECT_NE(hashOf(other.sweep(&other.memory)), hashOf(first));
  other.sequence.neighbours.clear();
  EXPECT_EQ(countKnown(other.sweep(&other.memory)), 0);
}

TEST(SurfaceMemoryTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Remembering test(66);
  std::vector<std::string> hashes;
  for (const size_t threads : {1U, 2U, 5U}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    hashes.push_back(hashOf(test.sweep(&test.memory)));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace vcharge
