#include "refinement/plane_smoothing.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "reference/plane_sweep_test_support.h"
#include "sweep/sweep_level.h"

namespace vcharge {
namespace {

using testing::allValid;
using testing::kCamera;
using testing::kLeft;
using testing::kSize;
using testing::lotScene;
using testing::makeSequence;
using testing::Sequence;

PlaneSweepOptions smoothed(double step, double jump) {
  PlaneSweepOptions options;
  options.semi_global_smoothing = true;
  options.smoothness_step = step;
  options.smoothness_jump = jump;
  options.num_refinement_steps = 0;
  return options;
}

/// A row of pixels with three planes, whose correlations are given: [pixel][plane].
struct Row {
  std::vector<Hypotheses> planes;
  std::vector<TileScores> scores;
  SurfaceEstimate estimate;

  explicit Row(const std::vector<std::vector<double>>& correlations)
      : planes(1), scores(1), estimate(cv::Size(static_cast<int>(correlations.size()), 1)) {
    const cv::Size size = estimate.score.size();
    planes[0].offsets = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f};
    planes[0].weight = cv::Mat(size, CV_32FC1, cv::Scalar(1.0f));
    TileScores& tile = scores[0];
    tile.tile = cv::Rect(cv::Point(), size);
    tile.layout.strip = size.width;
    tile.layout.rows = 1;
    tile.slots = {0, 1, 2, 3, 4};
    tile.num_neighbours = 1;
    tile.scores.resize(5 * correlations.size());
    tile.voter_bits.assign(5 * rowVoterBytes(1, size.width), 1);
    tile.best.assign(correlations.size(), 0);
    for (size_t x = 0; x < correlations.size(); ++x) {
      for (size_t k = 0; k < 5; ++k) {
        tile.scores[k * correlations.size() + x] = static_cast<int16_t>(kScoreScale * correlations[x][k]);
      }
    }
    estimate.plane.setTo(0);
  }

  std::vector<int> smooth(const PlaneSweepOptions& options) {
    PlaneSmoothing smoothing(estimate.score.size(), planes, options);
    smoothing.addTile(scores);
    smoothing.smooth(true, &estimate);
    return {estimate.plane.begin<int>(), estimate.plane.end<int>()};
  }
};

const std::vector<double> kLow = {0.0, 0.8, 0.0, 0.0, 0.0};
const std::vector<double> kHigh = {0.0, 0.0, 0.0, 0.8, 0.0};
const std::vector<double> kDoubtful = {0.0, 0.5, 0.0, 0.6, 0.0};

TEST(PlaneSmoothingTest, APixelInDoubtFollowsItsNeighbours) {
  Row row({kLow, kLow, kDoubtful, kLow, kLow});
  EXPECT_EQ(row.smooth(smoothed(0.0, 0.0)), (std::vector<int>{1, 1, 3, 1, 1}));
  EXPECT_EQ(row.smooth(smoothed(0.1, 0.2)), (std::vector<int>{1, 1, 1, 1, 1}));
  EXPECT_NEAR(row.estimate.inverse_range.at<float>(0, 2), 0.2, 1e-6);
  EXPECT_NEAR(row.estimate.score.at<float>(0, 2), 0.5, 1e-3);
  EXPECT_EQ(row.estimate.voters.at<int>(0, 2), 1);
}

TEST(PlaneSmoothingTest, SurePixelsKeepAnEdge) {
  Row row({kLow, kLow, kHigh, kHigh, kHigh});
  EXPECT_EQ(row.smooth(smoothed(0.1, 0.3)), (std::vector<int>{1, 1, 3, 3, 3}));
}

TEST(PlaneSmoothingTest, TheLeadIsWhatTheNextPathCosts) {
  // Paths from the left and the right: each pixel's own cost, and at most the jump from its neighbours.
  Row alone({kDoubtful});
  alone.smooth(smoothed(0.1, 0.3));
  EXPECT_NEAR(alone.estimate.score.at<float>(0, 0) - alone.estimate.second_score.at<float>(0, 0), 0.1, 0.01);
  Row agreed({kHigh, kHigh, kDoubtful, kHigh, kHigh});
  agreed.smooth(smoothed(0.1, 0.3));
  // Two of the four paths come from pixels where the other plane costs the whole jump more.
  EXPECT_NEAR(agreed.estimate.score.at<float>(0, 2) - agreed.estimate.second_score.at<float>(0, 2),
              0.1 + 0.5 * 0.3, 0.02);
}

TEST(PlaneSmoothingTest, WithoutCostsTheBestScoreWins) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -2, 0, 2.0);
  PlaneSweepOptions options = smoothed(0.0, 0.0);
  SweepDetails smooth, plain;
  PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours, &smooth);
  options.semi_global_smoothing = false;
  PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours, &plain);
  int same = 0, known = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      if (plain.plane.at<int>(y, x) >= 0) {
        ++known;
        same += smooth.plane.at<int>(y, x) == plain.plane.at<int>(y, x) ? 1 : 0;
        EXPECT_GT(smooth.score.at<float>(y, x), plain.score.at<float>(y, x) - 0.005f);
      }
    }
  }
  EXPECT_GT(same, 0.95 * known);
}

TEST(PlaneSmoothingTest, FindsMoreOfANoisyScene) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -2, 0, 25.0);
  int right[2] = {0, 0};
  for (const int is_smooth : {0, 1}) {
    PlaneSweepOptions options = smoothed(0.03, 0.1);
    options.semi_global_smoothing = is_smooth != 0;
    options.gate = false;
    const RangeMap map = PlaneSweep(kCamera, allValid(), options, s.ground).sweep(s.reference, s.neighbours);
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const double truth = s.truth.at<double>(y, x);
        right[is_smooth] += std::abs(map.range_m.at<float>(y, x) - truth) < 0.05 * truth ? 1 : 0;
      }
    }
  }
  EXPECT_GT(right[0], 1000);
  EXPECT_GT(right[1], 1.03 * right[0]);
}

TEST(PlaneSmoothingTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -2, 0, 2.0);
  PlaneSweepOptions options = smoothed(0.03, 0.1);
  options.coarse_pass = true;
  const PlaneSweep sweep(kCamera, allValid(), options, s.ground);
  testing::expectTheSameOnAnyNumberOfThreads(sweep, s);
}

}  // namespace
}  // namespace vcharge
