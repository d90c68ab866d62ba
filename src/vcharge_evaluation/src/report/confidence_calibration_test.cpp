#include "vcharge_evaluation/confidence_calibration.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(ConfidenceCalibrationTest, HonestConfidencesHaveNoError) {
  ConfidenceCalibration calibration;
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < 100000; ++i) {
    const double confidence = uniform(generator);
    calibration.add(confidence, uniform(generator) < confidence);
  }
  ASSERT_EQ(calibration.bins().size(), ConfidenceCalibration::kNumBins);
  EXPECT_LT(expectedCalibrationError(calibration.bins()),
            0.01);  // 1.6 standard deviations of a bin's fraction
}

TEST(ConfidenceCalibrationTest, BoastfulConfidencesAreOffByWhatTheyClaimTooMuch) {
  ConfidenceCalibration calibration;
  for (int i = 0; i < 100; ++i) {
    calibration.add(0.95, i < 50);
  }
  ASSERT_EQ(calibration.bins().size(), 1U);
  EXPECT_EQ(calibration.bins()[0].count, 100U);
  EXPECT_NEAR(calibration.bins()[0].mean_confidence, 0.95, 1e-12);
  EXPECT_NEAR(expectedCalibrationError(calibration.bins()), 0.45, 1e-12);
}

TEST(ConfidenceCalibrationTest, BoundsAndInvalidConfidencesHaveABin) {
  ConfidenceCalibration calibration;
  calibration.add(1.0, true);
  calibration.add(1.5, true);
  calibration.add(-0.5, false);
  calibration.add(std::numeric_limits<double>::quiet_NaN(), false);
  ASSERT_EQ(calibration.bins().size(), 2U);
  EXPECT_EQ(calibration.bins()[0].count, 2U);
  EXPECT_EQ(expectedCalibrationError(calibration.bins()), 0.0);
  EXPECT_EQ(expectedCalibrationError({}), 0.0);
}

TEST(ConfidenceCalibrationTest, NormalErrorsStayWithinOneAndTwoStandardDeviations) {
  EXPECT_NEAR(probabilityWithin(0.1, 0.1), 0.6827, 1e-4);
  EXPECT_NEAR(probabilityWithin(0.2, 0.1), 0.9545, 1e-4);
  EXPECT_EQ(probabilityWithin(0.1, std::numeric_limits<double>::quiet_NaN()), 0.0);
}

}  // namespace
}  // namespace vcharge
