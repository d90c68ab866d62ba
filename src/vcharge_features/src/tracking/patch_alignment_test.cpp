#include "vcharge_features/patch_alignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "extraction/test_images.h"
#include "vcharge_features/patch_tracker.h"

namespace vcharge {
namespace {

/// An image, and the same scene deformed around its middle.
class PatchAlignmentTest : public ::testing::Test {
 protected:
  PatchAlignmentTest() { cv::GaussianBlur(randomTexture({400, 300}, 1), first_, cv::Size(5, 5), 1.2); }

  void deform(double scale_x, double scale_y, double turn_rad) {
    warp_ = cv::Matx23d(scale_x * std::cos(turn_rad), -scale_y * std::sin(turn_rad), 5.3,
                        scale_x * std::sin(turn_rad), scale_y * std::cos(turn_rad), 3.7);
    warp_(0, 2) += 200.0 - warp_(0, 0) * 200.0 - warp_(0, 1) * 150.0;
    warp_(1, 2) += 150.0 - warp_(1, 0) * 200.0 - warp_(1, 1) * 150.0;
    cv::warpAffine(first_, second_, warp_, first_.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  }
  /// Adds noise of these standard deviations to the upper and the lower half of the deformed image.
  void addNoise(double upper_gray, double lower_gray) {
    cv::Mat noise(second_.size(), CV_16SC1), noisy;
    cv::RNG random(3);
    random.fill(noise.rowRange(0, 150), cv::RNG::NORMAL, 0.0, upper_gray);
    random.fill(noise.rowRange(150, 300), cv::RNG::NORMAL, 0.0, lower_gray);
    second_.convertTo(noisy, CV_16SC1);
    noisy += noise;
    noisy.convertTo(second_, CV_8UC1);
  }
  Eigen::Vector2d warped(const Eigen::Vector2d& p) const {
    return {warp_(0, 0) * p.x() + warp_(0, 1) * p.y() + warp_(0, 2),
            warp_(1, 0) * p.x() + warp_(1, 1) * p.y() + warp_(1, 2)};
  }
  static std::vector<Eigen::Vector2d> points() {
    std::vector<Eigen::Vector2d> points;
    for (int y = 75; y <= 225; y += 10) {
      for (int x = 100; x <= 300; x += 10) {
        points.emplace_back(x + 0.25, y - 0.4);
      }
    }
    return points;
  }

  /// Position errors of aligned patches, started half a pixel away without an initial estimate of the shape.
  std::vector<double> errorsOfAlignment() const {
    std::vector<double> errors_px;
    for (const Eigen::Vector2d& point : points()) {
      const PatchWarp start{warped(point) + Eigen::Vector2d(0.4, -0.3), Eigen::Matrix2d::Identity()};
      if (const auto aligned = alignPatch(first_, second_, point, start, options_)) {
        errors_px.push_back((aligned->position_px - warped(point)).norm());
      }
    }
    return errors_px;
  }

  std::vector<double> errorsOfTracker() const {
    PatchTrackerOptions options;
    options.window_px = 2 * options_.radius_px + 1;
    const PatchTracker tracker(options);
    std::vector<cv::Point2f> starts, expected;
    for (const Eigen::Vector2d& point : points()) {
      starts.emplace_back(static_cast<float>(point.x()), static_cast<float>(point.y()));
      expected.emplace_back(static_cast<float>(warped(point).x()), static_cast<float>(warped(point).y()));
    }
    std::vector<double> errors_px;
    const std::vector<TrackedPoint> tracked = tracker.track(
        tracker.buildPyramid(first_), tracker.buildPyramid(second_), starts, cv::Mat(), expected);
    for (size_t i = 0; i < tracked.size(); ++i) {
      if (tracked[i].status == TrackStatus::kTracked) {
        errors_px.push_back(cv::norm(tracked[i].position_px - expected[i]));
      }
    }
    return errors_px;
  }

  static double quantile(std::vector<double> values, double fraction) {
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(fraction * static_cast<double>(values.size() - 1))];
  }

  PatchAlignmentOptions options_;
  cv::Mat first_, second_;
  cv::Matx23d warp_;
};

TEST_F(PatchAlignmentTest, ScaleAndSlantPullNothingAside) {
  for (const auto& [scale_x, scale_y, turn_rad] : {std::make_tuple(1.0, 1.0, 0.0),
                                                   {1.1, 1.1, 0.0},
                                                   {0.85, 0.85, 0.0},
                                                   {1.0, 1.2, 0.05},
                                                   {1.2, 1.2, -0.1}}) {
    deform(scale_x, scale_y, turn_rad);
    const std::vector<double> errors_px = errorsOfAlignment();
    SCOPED_TRACE(testing::Message() << "scales " << scale_x << " and " << scale_y << ", turned by "
                                    << turn_rad);
    EXPECT_GT(errors_px.size(), 0.9 * static_cast<double>(points().size()));
    EXPECT_LT(quantile(errors_px, 0.5),
              0.06);  // interpolation between pixels causes this error even without scaling
    EXPECT_LT(quantile(errors_px, 0.95), 0.1);
  }
  EXPECT_GT(quantile(errorsOfTracker(), 0.5), 0.2) << "a patch that is moved alone does as well";
}

TEST_F(PatchAlignmentTest, NoiseCostsNoMoreThanWithoutAShape) {
  deform(1.0, 1.0, 0.0);
  addNoise(4.0, 4.0);
  const std::vector<double> aligned_px = errorsOfAlignment(), tracked_px = errorsOfTracker();
  EXPECT_LT(quantile(aligned_px, 0.5), 1.2 * quantile(tracked_px, 0.5));
  EXPECT_LT(quantile(aligned_px, 0.9), 1.3 * quantile(tracked_px, 0.9));
}

TEST_F(PatchAlignmentTest, TellsHowFarPositionsErr) {
  deform(1.05, 1.05, 0.0);
  addNoise(2.0, 8.0);
  std::vector<double> ratios[2], sigmas_px[2];
  for (const Eigen::Vector2d& point : points()) {
    const PatchWarp start{warped(point), Eigen::Matrix2d::Identity()};
    if (const auto aligned = alignPatch(first_, second_, point, start, options_)) {
      const int half = warped(point).y() < 150.0 ? 0 : 1;
      sigmas_px[half].push_back(aligned->sigma_px);
      ratios[half].push_back((aligned->position_px - warped(point)).norm() / aligned->sigma_px);
    }
  }
  // The norm of two errors of deviation 1 has the median 1.18.
  for (const std::vector<double>& of_half : ratios) {
    EXPECT_GT(of_half.size(), 100U);
    EXPECT_GT(quantile(of_half, 0.5), 0.4);
    EXPECT_LT(quantile(of_half, 0.5), 1.4);
  }
  EXPECT_GT(quantile(sigmas_px[1], 0.5), 1.5 * quantile(sigmas_px[0], 0.5));
}

TEST_F(PatchAlignmentTest, BrightnessAndContrastDoNotMatter) {
  deform(1.08, 1.08, 0.0);
  cv::Mat darker;
  second_.convertTo(darker, CV_8UC1, 0.5, 20.0);
  second_ = darker;
  const std::vector<double> errors_px = errorsOfAlignment();
  EXPECT_GT(errors_px.size(), 0.9 * static_cast<double>(points().size()));
  EXPECT_LT(quantile(errors_px, 0.5), 0.04);
}

TEST_F(PatchAlignmentTest, NothingIsFoundWhereThereIsNothing) {
  deform(1.0, 1.0, 0.0);
  const auto found = [&](const cv::Mat& current, const Eigen::Vector2d& anchor_px, const PatchWarp& start) {
    return alignPatch(first_, current, anchor_px, start, options_).has_value();
  };
  const Eigen::Vector2d middle(200.0, 150.0);
  const PatchWarp there{warped(middle), Eigen::Matrix2d::Identity()};
  ASSERT_TRUE(found(second_, middle, there));
  EXPECT_FALSE(found(cv::Mat(), middle, there));
  EXPECT_FALSE(found(cv::Mat(second_.size(), CV_8UC1, cv::Scalar(99)), middle, there)) << "no texture";
  EXPECT_FALSE(found(randomTexture({400, 300}, 2), middle, there)) << "another scene";
  EXPECT_FALSE(found(second_, {3.0, 150.0}, there)) << "anchor at the border";
  EXPECT_FALSE(found(second_, middle, {{398.0, 150.0}, Eigen::Matrix2d::Identity()})) << "at the border";
  EXPECT_FALSE(found(second_, middle, {{std::nan(""), 150.0}, Eigen::Matrix2d::Identity()}));
  EXPECT_FALSE(found(second_, middle, {there.position_px, Eigen::Matrix2d::Zero()})) << "no shape";
  EXPECT_FALSE(found(second_, middle, {there.position_px, 2.5 * Eigen::Matrix2d::Identity()})) << "too large";
}

TEST_F(PatchAlignmentTest, BadOptionsAreNamed) {
  PatchAlignmentOptions options;
  options.radius_px = 0;
  EXPECT_THAT([&] { options.validate(); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("radius_px")));
}

}  // namespace
}  // namespace vcharge
