#include "sweep/coarse_pass.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/half_resolution.h"
#include "reference/plane_sweep_test_support.h"
#include "sweep/tile_scorer.h"

namespace vcharge {
namespace {

SweepInput inputOf(const SweepLevel& level, const Sequence& sequence) {
  SweepInput input = level.makeInput(sequence.reference.pixels);
  for (const SweepImage& image : sequence.neighbours) {
    const RigidTransform pose = image.world_from_camera.inverse() * sequence.reference.world_from_camera;
    input.neighbours.push_back({PackedImage(image.pixels, level.validMask()), level.camera(),
                                pose.rotationMatrix().cast<float>(), pose.translation().cast<float>(),
                                false});
  }
  return input;
}

/// A sequence and the level that sweeps it.
struct Level {
  Sequence sequence;
  std::shared_ptr<const SweepLevel> level;
  std::vector<cv::Rect> tiles;

  Level()
      : sequence(makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0)),
        level(std::make_shared<SweepLevel>(kCamera, allValid(), PlaneSweepOptions(), sequence.ground)),
        tiles(makeTiles(kSize, TileSize::kSmall)) {}

  SweepInput input() const { return inputOf(*level, sequence); }
  SweepPixels halfPixels() const {
    SweepPixels pixels{sequence.reference.pixels, {}};
    for (const SweepImage& image : sequence.neighbours) {
      pixels.neighbours.push_back(image.pixels);
    }
    return halved(pixels);
  }
};

bool sameBytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

std::vector<int> allSlots(const Hypotheses& planes) {
  std::vector<int> slots(planes.offsets.size());
  std::iota(slots.begin(), slots.end(), 0);
  return slots;
}

TEST(CoarsePassTest, PlanesLeftOutDoNotChangeTheScoresOfOthers) {
  const Level setup;
  onEveryTarget([&] {
    const SweepInput input = setup.input();
    const Hypotheses& planes = setup.level->planes().front();
    TileScorer scorer;
    scorer.setTile(input, setup.tiles[setup.tiles.size() / 2]);
    TileScores all, some;
    scorer.score(planes, &all);
    scorer.score(planes, {kGap, 4, 5, 6, kGap, 9, kGap}, &some);
    const size_t row = all.layout.rowSize();
    int inside = 0;
    for (int y = 0; y < all.tile.height; ++y) {
      for (size_t slot = 0; slot < some.slots.size(); ++slot) {
        const int16_t* scores =
            some.scores.data() + (static_cast<size_t>(y) * some.slots.size() + slot) * row;
        if (some.slots[slot] == kGap) {
          EXPECT_TRUE(std::all_of(scores, scores + row, [](int16_t score) { return score == kNoScore; }));
          continue;
        }
        const size_t plane = static_cast<size_t>(some.slots[slot]);
        EXPECT_EQ(
            std::memcmp(scores, all.scores.data() + (static_cast<size_t>(y) * all.slots.size() + plane) * row,
                        row * sizeof(int16_t)),
            0);
      }
      for (int x = 0; x < all.tile.width; ++x) {
        const size_t pixel = all.layout.index(y, x);
        const int best = some.best[pixel];
        ASSERT_GE(best, 0);
        ASSERT_NE(some.slots[static_cast<size_t>(best)], kGap);
        EXPECT_EQ(some.isInside(best), best == 2);
        EXPECT_EQ(some.voters(best, pixel), all.voters(some.slots[static_cast<size_t>(best)], pixel));
        inside += best == 2 ? 1 : 0;
      }
    }
    EXPECT_GT(inside, 0);
  });
}

TEST(TileScorerTest, GathersAndLoadsGiveTheSame) {
  const Level setup;
  onEveryTarget([&] {
    SweepInput input = setup.input();
    TileScores scores[2];
    for (const bool by_loads : {false, true}) {
      input.kernels.correlate = by_loads ? input.kernels.correlateByLoads : input.kernels.correlateByGathers;
      TileScorer scorer;
      scorer.setTile(input, setup.tiles[setup.tiles.size() / 2]);
      scorer.score(setup.level->planes().front(), &scores[by_loads ? 1 : 0]);
    }
    ASSERT_GT(scores[0].scores.size(), 0U);
    ASSERT_EQ(scores[0].scores.size(), scores[1].scores.size());
    EXPECT_EQ(std::memcmp(scores[0].scores.data(), scores[1].scores.data(),
                          scores[0].scores.size() * sizeof(int16_t)),
              0);
    EXPECT_EQ(scores[0].voter_bits, scores[1].voter_bits);
  });
}

TEST(TileScorerTest, RowsWithoutTextureDoNotChangeOthers) {
  Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0);
  const int first = 90, end = 110;  // rows with texture
  s.reference.pixels.rowRange(0, first).setTo(90);
  s.reference.pixels.rowRange(end, kSize.height).setTo(90);
  PlaneSweepOptions options;
  options.warp_tolerance_px = 0.0;  // exact everywhere, so that the choice of tiles has no effect
  const SweepLevel level(kCamera, allValid(), options, s.ground);
  const SweepInput input = inputOf(level, s);
  const int radius = kMatchingWindow_px / 2;
  const cv::Rect tight(40, first - radius, 100, end - first + 2 * radius);
  const cv::Rect wide(tight.x, tight.y - 20, tight.width, tight.height + 35);
  TileScorer scorer;
  TileScores of_tight, of_wide;
  scorer.setTile(input, tight);
  scorer.score(level.planes().front(), &of_tight);
  scorer.setTile(input, wide);
  scorer.score(level.planes().front(), &of_wide);
  int known = 0;
  for (int y = 0; y < wide.height; ++y) {
    for (int x = 0; x < wide.width; ++x) {
      const size_t pixel = of_wide.layout.index(y, x);
      const int row = wide.y + y - tight.y;
      if (row < 0 || row >= tight.height) {
        EXPECT_EQ(of_wide.best[pixel], -1);
        EXPECT_EQ(of_wide.second[pixel], -1);
        continue;
      }
      const size_t same = of_tight.layout.index(row, x);
      ASSERT_EQ(of_wide.best[pixel], of_tight.best[same]);
      EXPECT_EQ(of_wide.second[pixel], of_tight.second[same]);
      if (of_tight.best[same] >= 0) {
        ++known;
        EXPECT_EQ(of_wide.best_score[pixel], of_tight.best_score[same]);
        EXPECT_EQ(of_wide.voters(of_wide.best[pixel], pixel), of_tight.voters(of_tight.best[same], same));
      }
    }
  }
  EXPECT_GT(known, 1000);
}

TEST(CoarsePassTest, EqualsTheFullSweepWhereAllPlanesAreChosen) {
  const Level setup;
  const SweepInput input = setup.input();
  const CoarsePass coarse(setup.level, setup.sequence.ground);
  // Without a coarse estimate no pixel is confident.
  const std::vector<TilePlanes> choice =
      coarse.choosePlanes(SurfaceEstimate(cv::Size(kSize.width / 2, kSize.height / 2)), setup.tiles);
  ASSERT_EQ(choice.size(), setup.tiles.size());
  for (const TilePlanes& planes : choice) {
    for (size_t f = 0; f < planes.size(); ++f) {
      EXPECT_EQ(planes[f], allSlots(setup.level->planes()[f]));
    }
  }
  const SurfaceEstimate full = setup.level->sweepPlanes(input, setup.tiles, {});
  SurfaceEstimate chosen = setup.level->sweepPlanes(input, setup.tiles, choice);
  SurfaceEstimate uncertain(cv::Size(kSize.width / 2, kSize.height / 2));
  uncertain.second_score.setTo(1.0f);
  coarse.addSecondPeaks(uncertain, setup.tiles, choice, &chosen);
  EXPECT_TRUE(sameBytes(full.inverse_range, chosen.inverse_range));
  EXPECT_TRUE(sameBytes(full.score, chosen.score));
  EXPECT_TRUE(sameBytes(full.second_score, chosen.second_score));
  EXPECT_TRUE(sameBytes(full.plane, chosen.plane));
  EXPECT_TRUE(sameBytes(full.voters, chosen.voters));
  EXPECT_TRUE(sameBytes(full.at_limit, chosen.at_limit));
}

TEST(CoarsePassTest, SweepsFewPlanesAmongThemTheRightOnes) {
  const Level setup;
  const SweepInput input = setup.input();
  const CoarsePass coarse(setup.level, setup.sequence.ground);
  const SurfaceEstimate found = coarse.sweep(input, setup.halfPixels(), false).estimate;
  EXPECT_EQ(found.score.size(), cv::Size(kSize.width / 2, kSize.height / 2));
  const std::vector<TilePlanes> choice = coarse.choosePlanes(found, setup.tiles);
  const Hypotheses& planes = setup.level->planes().front();
  const float step = planes.offsets[1] - planes.offsets[0];
  int all = 0, swept = 0, pixels = 0, covered = 0;
  for (size_t i = 0; i < setup.tiles.size(); ++i) {
    const std::vector<int>& slots = choice[i].front();
    all += static_cast<int>(planes.offsets.size());
    swept +=
        static_cast<int>(std::count_if(slots.begin(), slots.end(), [](int slot) { return slot != kGap; }));
    for (int y = setup.tiles[i].y; y < setup.tiles[i].br().y; ++y) {
      for (int x = setup.tiles[i].x; x < setup.tiles[i].br().x; ++x) {
        const double truth = setup.sequence.truth.at<double>(y, x);
        const double distance = 1.0 / truth / planes.weight.at<float>(y, x);
        const auto index = static_cast<int>(std::lround((distance - planes.offsets.front()) / step));
        if (std::isfinite(truth) && index >= 0 && index < static_cast<int>(planes.offsets.size())) {
          ++pixels;
          covered += std::find(slots.begin(), slots.end(), index) != slots.end() ? 1 : 0;
        }
      }
    }
  }
  RecordProperty("swept", std::to_string(static_cast<double>(swept) / all));
  RecordProperty("covered", std::to_string(static_cast<double>(covered) / pixels));
  EXPECT_LT(swept, 0.5 * all);
  EXPECT_GT(pixels, 0.8 * kSize.area());
  EXPECT_GT(covered, 0.97 * pixels);
}

TEST(CoarsePassTest, HalfOfTheImagesFindASurfaceThatIsPredicted) {
  const Level setup;
  const CoarsePass coarse(setup.level, setup.sequence.ground);
  const SweepPixels half = setup.halfPixels();
  const SurfaceEstimate with_all = coarse.sweep(setup.input(), half, false).estimate;
  const SurfaceEstimate with_half = coarse.sweep(setup.input(), half, true).estimate;
  int confident = 0, agree = 0, voters = 0;
  for (int y = 0; y < with_all.score.rows; ++y) {
    for (int x = 0; x < with_all.score.cols; ++x) {
      voters |= with_half.voters.at<int>(y, x);
      if (isConfident(with_half.score.at<float>(y, x), with_half.second_score.at<float>(y, x))) {
        ++confident;
        const float difference =
            with_half.inverse_range.at<float>(y, x) - with_all.inverse_range.at<float>(y, x);
        agree += std::abs(difference) <= with_all.step.at<float>(y, x) ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(voters, 3) << "two of four images";
  EXPECT_GT(confident, 0.4 * with_all.score.size().area());
  EXPECT_GT(agree, 0.97 * confident);
}

TEST(CoarsePassTest, SecondPeaksOfPlanesThatWereLeftOutCount) {
  const Level setup;
  const CoarsePass coarse(setup.level, setup.sequence.ground);
  SurfaceEstimate found(cv::Size(kSize.width / 2, kSize.height / 2)), estimate(kSize);
  found.second_score.setTo(0.5f);
  estimate.second_score.setTo(0.2f);
  estimate.second_score.at<float>(50, 50) = 0.8f;
  TilePlanes some, all;
  for (const Hypotheses& planes : setup.level->planes()) {
    all.push_back(allSlots(planes));
    some.push_back({kGap, 3, 4, kGap});
  }
  coarse.addSecondPeaks(found, {cv::Rect(40, 40, 20, 20), cv::Rect(80, 40, 20, 20)}, {some, all}, &estimate);
  EXPECT_EQ(estimate.second_score.at<float>(45, 45), 0.5f);
  EXPECT_EQ(estimate.second_score.at<float>(50, 50), 0.8f);
  EXPECT_EQ(estimate.second_score.at<float>(45, 85), 0.2f);
}

TEST(CoarsePassTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0);
  PlaneSweepOptions options;
  options.coarse_pass = true;
  expectTheSameOnAnyNumberOfThreads(options, s);
}

TEST(CoarsePassTest, KeepsWhatTheFullSweepFinds) {
  const Sequence s = makeSequence(lotScene(20), kLeft, 0.2, -4, 0, 2.0);
  PlaneSweepOptions options;
  const int full = countRight(sweepOf(s, options), s.truth, 0.05);
  options.coarse_pass = true;
  const int chosen = countRight(sweepOf(s, options), s.truth, 0.05);
  EXPECT_GT(full, 0.7 * kSize.area());
  EXPECT_GE(chosen, 0.99 * full);
}

TEST(CoarsePassTest, OddAndSmallImagesWork) {
  for (const cv::Size size : {cv::Size(101, 77), cv::Size(20, 40)}) {
    const cv::Rect part(60, 60, size.width, size.height);
    Sequence s = makeSequence(lotScene(2), kLeft, 0.1, -2, 0);
    crop(part, &s);
    const MeiCamera camera = croppedCamera(part);
    PlaneSweepOptions options;
    options.coarse_pass = true;
    const RangeMap map = PlaneSweep(camera, cv::Mat(size, CV_8UC1, cv::Scalar(255)), options, s.ground)
                             .sweep(s.reference, s.neighbours);
    EXPECT_GT(countKnown(map), 0.3 * size.area()) << size;
  }
}

}  // namespace
}  // namespace vcharge
