#include "vcharge_dense/plane_sweep.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "reference/plain_plane_sweep.h"
#include "reference/plane_sweep_test_support.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge {
namespace {

// Samples are rounded to 1/256 pixel and 1/8 gray level, and the warp is interpolated between nodes: scores
// and the parabolas' maxima (in planes) differ by thousandths.
TEST(PlaneSweepTest, EqualsThePlainReference) {
  for (const Aggregation aggregation : {Aggregation::kMean, Aggregation::kReferenceSplit}) {
    const Sequence s = makeSequence(lotScene(2), kLeft, 0.15, -2, 2, 1.0);
    PlaneSweepOptions options;
    options.num_refinement_steps = 0;
    options.num_planes = 32;
    options.num_ground_planes = 8;
    options.aggregation = aggregation;
    options.min_confidence = 0.0;
    options.near_spacing = aggregation == Aggregation::kReferenceSplit ? 5.0 : 1.0;
    cv::Mat mask = allValid();
    mask(cv::Rect(100, 150, 60, 50)).setTo(0);
    const PlaneSweep sweep(kCamera, mask, options, s.ground);
    const std::vector<float>& inverse = sweep.families()[0].inverse_distances_per_m;
    const PlainResult plain = plainPlaneSweep(kCamera, mask, sweep.families(), options, s.reference,
                                              s.neighbours, PlainBorder::kUnknown);
    onEveryTarget([&] {
      SweepDetails details;
      const RangeMap map = sweep.sweep(s.reference, s.neighbours, &details);
      int same_plane = 0, same_score = 0, same_range = 0;
      for (int y = 0; y < kSize.height; ++y) {
        for (int x = 0; x < kSize.width; ++x) {
          EXPECT_EQ(details.plane.at<int>(y, x) < 0, plain.plane.at<int>(y, x) < 0) << x << ", " << y;
          if (details.plane.at<int>(y, x) == plain.plane.at<int>(y, x)) {
            ++same_plane;
            const double expected = plain.inverse_range.at<double>(y, x);
            const double range = map.range_m.at<float>(y, x);
            const bool both_unknown = std::isnan(range) && !(expected > 0.0);
            const double tolerance = 0.01 * (inverse[inverse.size() - 1] - inverse[inverse.size() - 2]);
            same_range += both_unknown || std::abs(1.0 / range - expected) <= tolerance ? 1 : 0;
            const double score = details.score.at<float>(y, x) - plain.score.at<double>(y, x);
            same_score += both_unknown || std::abs(score) <= 0.002 ? 1 : 0;
          }
        }
      }
      EXPECT_GE(same_plane, 0.995 * kSize.area()) << "aggregation " << static_cast<int>(aggregation);
      EXPECT_GE(same_score, 0.999 * same_plane);
      EXPECT_GE(same_range, 0.999 * same_plane);
    });
  }
}

TEST(PlaneSweepTest, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0);
  const PlaneSweepOptions options;
  expectTheSameOnAnyNumberOfThreads(options, s);
}

TEST(PlaneSweepTest, ResultsDoNotDependOnEarlierSweeps) {
  const Sequence s = makeSequence(lotScene(2), kLeft, 0.2, -4, 0, 2.0);
  const Sequence other = makeSequence(lotScene(3), kFront, 0.2, -3, 0, 2.0);
  PlaneSweepOptions options;
  options.coarse_pass = true;
  const std::string fresh = hashOf(sweepOf(s, options));
  const PlaneSweep sweep(kCamera, allValid(), options, s.ground);
  EXPECT_NE(hashOf(sweep.sweep(other.reference, other.neighbours)), fresh);
  EXPECT_EQ(hashOf(sweep.sweep(s.reference, s.neighbours)), fresh);
}

TEST(PlaneSweepTest, MaskedPixelsAreUnknownAndDoNotVote) {
  const Sequence s = makeSequence(lotScene(1), kLeft, 0.2, -4, 0);
  cv::Mat mask = allValid();
  const cv::Rect hole(140, 90, 40, 30);
  mask(hole).setTo(0);
  Sequence painted = s;  // pixels under the mask must not have an effect
  for (SweepImage& image : painted.neighbours) {
    image.pixels(hole).setTo(255);
  }
  painted.reference.pixels(hole).setTo(0);
  const RangeMap map = sweepOf(s, PlaneSweepOptions(), nullptr, mask);
  EXPECT_EQ(hashOf(map), hashOf(sweepOf(painted, PlaneSweepOptions(), nullptr, mask)));
  const cv::Rect touched(hole.x - 3, hole.y - 3, hole.width + 6, hole.height + 6);
  EXPECT_EQ(cv::countNonZero(map.range_m(touched) == map.range_m(touched)), 0);
  EXPECT_GT(countKnown(map), 0.8 * (kSize.area() - touched.area()));
}

TEST(PlaneSweepTest, PixelsWithoutTextureAreUnknown) {
  const AnalyticScene bare({{{0, 0, 0}, {0, 0, 1}, Eigen::Vector3d::Constant(1e6), 0.0}}, 1);
  const Sequence s = makeSequence(bare, kLeft, 0.2, -4, 0, 1.0);
  const RangeMap map = sweepOf(s, PlaneSweepOptions());
  EXPECT_LE(countKnown(map), 0.001 * kSize.area());
}

TEST(PlaneSweepTest, NoNeighbourLeavesEverythingUnknown) {
  const Sequence s = makeSequence(lotScene(1), kLeft, 0.2, 0, 0);
  const RangeMap map = sweepOf(s, PlaneSweepOptions());
  EXPECT_EQ(map.range_m.size(), kSize);
  EXPECT_EQ(countKnown(map), 0);
  EXPECT_EQ(cv::countNonZero(map.confidence), 0);
}

TEST(PlaneSweepTest, RejectsBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(nan, 0, 0)), std::logic_error);
  PlaneSweepOptions options;
  EXPECT_THROW(PlaneSweep(kCamera, allValid(), options), std::invalid_argument);  // no ground
  options.num_planes = 2;
  EXPECT_THROW(PlaneSweep(kCamera, allValid(), options, groundInCamera(kLeft)), std::invalid_argument);
  const PlaneSweep sweep(kCamera, allValid(), plainOptions());
  SweepImage small{Timestamp(), cv::Mat(10, 10, CV_8UC1, cv::Scalar(0)), RigidTransform()};
  EXPECT_THROW(sweep.sweep(small, {}), std::logic_error);
}

}  // namespace
}  // namespace vcharge
