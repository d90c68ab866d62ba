#include "vcharge_evaluation/range_evaluator.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

const cv::Size kSize(160, 100);
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A frame with texture everywhere and a true range of 4 m, which the test modifies.
struct Frame {
  Frame()
      : map{Timestamp(),
            "left",
            "camera_left_optical",
            MeiCamera(0.0, 80.0, 80.0, 79.5, 49.5),
            cv::Mat(kSize, CV_32FC1, cv::Scalar(4.0)),
            cv::Mat(kSize, CV_32FC1, cv::Scalar(0.1)),
            cv::Mat(kSize, CV_32FC1, cv::Scalar(0.5))},
        image(kSize, CV_8UC1),
        truth(kSize, CV_32FC1, cv::Scalar(4.0)),
        valid(kSize, CV_8UC1, cv::Scalar(255)) {
    std::mt19937 generator(1);
    for (int i = 0; i < kSize.area(); ++i) {
      image.data[i] = static_cast<uint8_t>(generator() % 256);
    }
  }
  RangeErrors evaluate(const std::optional<Eigen::Vector3d>& travel = std::nullopt) const {
    RangeEvaluationOptions options;
    options.pixel_step = pixel_step;
    RangeEvaluator evaluator(options);
    evaluator.add(map, image, truth, valid, travel);
    return evaluator.errors();
  }
  RangeMap map;
  cv::Mat image, truth, valid;
  int pixel_step = 1;
};

const RangeAccuracy& at(const RangeErrors& errors, double density) {
  for (const RangeAccuracy& accuracy : errors.accuracy) {
    if (std::abs(accuracy.density - density) < 1e-9) {
      return accuracy;
    }
  }
  throw std::logic_error("density was not evaluated");
}

TEST(RangeEvaluatorTest, PerfectMapIsCorrect) {
  const RangeErrors errors = Frame().evaluate();
  EXPECT_EQ(errors.num_judged, static_cast<uint64_t>(kSize.area()));
  EXPECT_EQ(errors.num_known, errors.num_judged);
  EXPECT_DOUBLE_EQ(at(errors, 1.0).fraction_within_tolerance, 1.0);
}

TEST(RangeEvaluatorTest, PixelStepSelectsColumnsAndRows) {
  Frame frame;
  frame.pixel_step = 2;
  EXPECT_EQ(frame.evaluate().num_judged, static_cast<uint64_t>(kSize.area() / 4));
}

TEST(RangeEvaluatorTest, UnknownRangesCountAsWrongAtFixedDensity) {
  Frame frame;
  frame.map.range_m.rowRange(0, 50).setTo(kNan);
  const RangeErrors errors = frame.evaluate();
  EXPECT_DOUBLE_EQ(at(errors, 0.4).fraction_within_tolerance, 1.0);
  EXPECT_NEAR(at(errors, 1.0).fraction_within_tolerance, 0.5, 1e-9);
  EXPECT_NEAR(at(errors, 0.8).fraction_within_tolerance, 0.5 / 0.8, 1e-9);
  EXPECT_EQ(errors.num_known, errors.num_judged / 2);
}

TEST(RangeEvaluatorTest, UnknownRangesCountAsTheLargestError) {
  Frame frame;
  frame.map.range_m.rowRange(0, 30).setTo(kNan);
  frame.map.range_m.rowRange(30, 40).setTo(4.4);
  const ErrorDistribution errors = frame.evaluate().bounded_relative_error;
  EXPECT_EQ(errors.count, static_cast<size_t>(kSize.area()));
  EXPECT_NEAR(errors.mean, 0.3 * 0.5 + 0.1 * 0.1, 1e-6);
  EXPECT_EQ(errors.max, 0.5);
  for (const RangeBin& bin : frame.evaluate().by_truth) {
    EXPECT_EQ(bin.num_judged, bin.low == 4.0 ? static_cast<size_t>(kSize.area()) : 0U);
    EXPECT_EQ(bin.count, bin.num_judged * 7 / 10);
  }
}

TEST(RangeEvaluatorTest, ConfidencesAreComparedWithRangesWithinTenPercent) {
  Frame frame;
  frame.map.range_m.rowRange(0, 50).setTo(4.5);  // 12.5 % off
  const std::vector<ConfidenceBin> bins = frame.evaluate().calibration;
  ASSERT_EQ(bins.size(), 1U);
  EXPECT_NEAR(bins[0].mean_confidence, 0.5, 1e-6);
  EXPECT_NEAR(bins[0].fraction_right, 0.5, 1e-9);
}

TEST(RangeEvaluatorTest, MostConfidentPixelsAreTakenFirst) {
  Frame frame;
  frame.map.range_m.rowRange(0, 60).setTo(4.3);  // 7.5 % off
  frame.map.confidence.rowRange(0, 60).setTo(0.2);
  EXPECT_DOUBLE_EQ(at(frame.evaluate(), 0.4).fraction_within_tolerance, 1.0);
  frame.map.confidence.rowRange(0, 60).setTo(0.9);
  EXPECT_DOUBLE_EQ(at(frame.evaluate(), 0.6).fraction_within_tolerance, 0.0);
  EXPECT_NEAR(at(frame.evaluate(), 0.6).median_relative_error, 0.075, 1e-6);
}

TEST(RangeEvaluatorTest, OnlyTexturedValidPixelsInRangeAreJudged) {
  Frame frame;
  frame.image.colRange(0, 40).setTo(100);  // flat: the window of 7 px reaches 3 px into it
  EXPECT_EQ(frame.evaluate().num_judged, static_cast<uint64_t>((160 - 37) * 100));
  Frame masked;
  masked.valid.colRange(0, 40).setTo(0);
  EXPECT_EQ(masked.evaluate().num_judged, static_cast<uint64_t>(120 * 100));
  Frame far;
  far.truth.colRange(0, 40).setTo(21.0);
  far.truth.colRange(40, 80).setTo(0.4);
  far.truth.colRange(80, 120).setTo(kNan);
  EXPECT_EQ(far.evaluate().num_judged, static_cast<uint64_t>(40 * 100));
}

TEST(RangeEvaluatorTest, RaysNearTheDirectionOfTravelAreNotJudged) {
  const Frame frame;
  // With a focal length of 80 px, 20 degrees around the axis are a disc of radius 80 tan 20 = 29.1 px.
  const double disc = M_PI * std::pow(80.0 * std::tan(20.0 * M_PI / 180.0), 2.0);
  for (const double sign : {1.0, -1.0}) {
    const auto judged = frame.evaluate(Eigen::Vector3d(0.0, 0.0, 3.0 * sign)).num_judged;
    EXPECT_NEAR(static_cast<double>(kSize.area() - judged), disc, 0.02 * disc);
  }
}

TEST(RangeEvaluatorTest, FractionsWithinSigmaFollowTheNormalDistribution) {
  Frame frame;
  std::mt19937 generator(2);
  std::normal_distribution<float> normal(0.0F, 0.05F);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      frame.map.range_m.at<float>(y, x) += normal(generator);
    }
  }
  frame.map.standard_deviation_m.setTo(0.05);
  EXPECT_NEAR(frame.evaluate().fraction_within_one_sigma, 0.683, 0.012);
  EXPECT_NEAR(frame.evaluate().fraction_within_two_sigma, 0.954, 0.008);
}

TEST(RangeEvaluatorTest, BadOptionsAndOtherSizesAreRefused) {
  RangeEvaluationOptions options;
  options.densities = {1.5};
  EXPECT_THROW(RangeEvaluator{options}, std::invalid_argument);
  Frame frame;
  frame.truth = cv::Mat(10, 10, CV_32FC1, cv::Scalar(1.0));
  EXPECT_THROW(frame.evaluate(), std::logic_error);
}

}  // namespace
}  // namespace vcharge
