#include "vcharge_features/patch_tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "extraction/test_images.h"

namespace vcharge {
namespace {

std::vector<cv::Point2f> gridOfPoints(cv::Size size, int step_px, int margin_px) {
  std::vector<cv::Point2f> points;
  for (int y = margin_px; y < size.height - margin_px; y += step_px) {
    for (int x = margin_px; x < size.width - margin_px; x += step_px) {
      points.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  return points;
}

class PatchTrackerTest : public ::testing::Test {
 protected:
  PatchTrackerTest() {
    cv::Mat texture = randomTexture({400, 300}, 1);
    cv::GaussianBlur(texture, first_, cv::Size(5, 5), 1.0);
    cv::warpAffine(first_, second_, warp_, first_.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  }
  cv::Point2f warped(const cv::Point2f& p) const {
    return {static_cast<float>(warp_(0, 0) * p.x + warp_(0, 1) * p.y + warp_(0, 2)),
            static_cast<float>(warp_(1, 0) * p.x + warp_(1, 1) * p.y + warp_(1, 2))};
  }
  std::vector<TrackedPoint> track(const std::vector<cv::Point2f>& points, const cv::Mat& mask = cv::Mat(),
                                  const std::vector<cv::Point2f>& predicted = {}) const {
    return tracker_.track(tracker_.buildPyramid(first_), tracker_.buildPyramid(second_), points, mask,
                          predicted);
  }
  const cv::Matx23d warp_{1.01, 0.02, 5.3, -0.02, 1.01, 3.7};
  const PatchTracker tracker_;
  cv::Mat first_, second_;
};

TEST_F(PatchTrackerTest, FollowsAKnownWarpToAFifthOfAPixel) {
  const std::vector<cv::Point2f> points = gridOfPoints(first_.size(), 13, 30);
  const std::vector<TrackedPoint> tracked = track(points);
  int right = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (tracked[i].status == TrackStatus::kTracked) {
      // The patch is tracked as a rigid window: its scale of 1 % is a tenth of a pixel at its rim.
      EXPECT_LT(cv::norm(tracked[i].position_px - warped(points[i])), 0.2) << points[i];
      ++right;
    }
  }
  EXPECT_GT(right, 0.95 * static_cast<double>(points.size()));
}

TEST_F(PatchTrackerTest, APredictionBridgesAMotionTooLargeForThePyramid) {
  cv::Mat wide = randomTexture({800, 200}, 2);
  cv::GaussianBlur(wide, wide, cv::Size(5, 5), 1.0);
  first_ = wide(cv::Rect(0, 0, 500, 200)).clone();
  second_ = wide(cv::Rect(250, 0, 500, 200)).clone();
  std::vector<cv::Point2f> points = gridOfPoints({200, 200}, 20, 30), predicted;
  for (cv::Point2f& point : points) {
    point.x += 270.0F;
    predicted.emplace_back(point.x - 247.0F, point.y + 2.0F);
  }
  const auto countRight = [&](const std::vector<TrackedPoint>& tracked) {
    size_t right = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      right += tracked[i].status == TrackStatus::kTracked &&
               cv::norm(tracked[i].position_px - points[i] + cv::Point2f(250.0F, 0.0F)) < 0.1;
    }
    return right;
  };
  EXPECT_LT(countRight(track(points)), points.size() / 4);
  EXPECT_EQ(countRight(track(points, cv::Mat(), predicted)), points.size());
}

TEST_F(PatchTrackerTest, ChangedPartsAreNotTracked) {
  // The right half shows a different scene.
  randomTexture({200, 300}, 77).copyTo(second_(cv::Rect(200, 0, 200, 300)));
  int left = 0, right = 0;
  const std::vector<cv::Point2f> points = gridOfPoints(first_.size(), 11, 20);
  const std::vector<TrackedPoint> tracked = track(points);
  for (size_t i = 0; i < points.size(); ++i) {
    const bool is_tracked = tracked[i].status == TrackStatus::kTracked;
    left += points[i].x < 170.0F && is_tracked;
    right += points[i].x > 230.0F && is_tracked;
  }
  EXPECT_GT(left, 200);
  EXPECT_LT(right, left / 20);
}

TEST_F(PatchTrackerTest, SaysWhyPointsAreNotTracked) {
  cv::Mat mask(first_.size(), CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 100) = 0;
  const std::vector<TrackedPoint> tracked =
      track({{50.0F, 150.0F}, {250.0F, 150.0F}, {NAN, 20.0F}, {-5.0F, 20.0F}, {1e30F, 20.0F}}, mask);
  EXPECT_EQ(tracked[0].status, TrackStatus::kMasked);
  EXPECT_EQ(tracked[1].status, TrackStatus::kTracked);
  EXPECT_EQ(tracked[2].status, TrackStatus::kLost);
  EXPECT_EQ(tracked[3].status, TrackStatus::kLost);
  EXPECT_EQ(tracked[4].status, TrackStatus::kLost);
  first_ = cv::Mat(first_.size(), CV_8UC1, cv::Scalar(80));
  second_ = first_.clone();
  EXPECT_EQ(track({{200.0F, 150.0F}})[0].status, TrackStatus::kLost) << "no texture";
  EXPECT_TRUE(track({}).empty());
}

TEST_F(PatchTrackerTest, ImagesSmallerThanThePatchAreNoCrash) {
  for (const cv::Size& size : {cv::Size(1, 1), cv::Size(3, 9), cv::Size(20, 20)}) {
    first_ = randomTexture(size, 1);
    second_ = first_.clone();
    EXPECT_EQ(track({{0.0F, 0.0F}, {2.0F, 2.0F}}).size(), 2U);
  }
}

TEST_F(PatchTrackerTest, PartsOfAnImageAreTrackedAsTheirCopies) {
  const cv::Rect part(40, 30, 300, 200);
  const std::vector<cv::Point2f> points = gridOfPoints(part.size(), 17, 3);
  const auto trackParts = [&](const cv::Mat& first, const cv::Mat& second) {
    return tracker_.track(tracker_.buildPyramid(first), tracker_.buildPyramid(second), points);
  };
  const auto views = trackParts(first_(part), second_(part));
  const auto copies = trackParts(first_(part).clone(), second_(part).clone());
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(views[i].status, copies[i].status);
    EXPECT_EQ(views[i].position_px, copies[i].position_px);
  }
}

TEST_F(PatchTrackerTest, BadArgumentsAreNamed) {
  const auto throwing = [](const char* text) {
    return ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr(text));
  };
  EXPECT_THAT([&] { tracker_.buildPyramid(cv::Mat()); }, throwing("image"));
  EXPECT_THAT([&] { tracker_.buildPyramid(cv::Mat::zeros(50, 50, CV_16UC1)); }, throwing("image"));
  const ImagePyramid pyramid = tracker_.buildPyramid(first_);
  EXPECT_THAT([&] { tracker_.track(pyramid, ImagePyramid(), {}); }, throwing("previous and current"));
  EXPECT_THAT([&] { tracker_.track(pyramid, pyramid, {}, cv::Mat::zeros(9, 9, CV_8UC1)); }, throwing("mask"));
  EXPECT_THAT(
      [&] {
        track({{1.0F, 1.0F}}, cv::Mat(), {{1.0F, 1.0F}, {2.0F, 2.0F}});
      },
      throwing("predicted_px"));
  PatchTrackerOptions options;
  options.max_forward_backward_px = std::nan("");
  EXPECT_THAT([&] { const PatchTracker bad(options); }, throwing("max_forward_backward_px"));
  options = PatchTrackerOptions();
  options.window_px = 20;
  EXPECT_THAT([&] { const PatchTracker bad(options); }, throwing("window_px"));
}

}  // namespace
}  // namespace vcharge
