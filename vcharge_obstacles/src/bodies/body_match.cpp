#include "bodies/body_match.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "bodies/body_part.h"

namespace vcharge {
namespace {

// Part of a body that is compared: the torso, and the legs but the feet.
constexpr double kWidth_m = 0.44, kBottom_m = 0.15, kMaxTop_m = 1.6;
constexpr int kMinWidth_px = 7, kMinHeight_px = 10, kMinSearch_px = 2;

bool isVisible(const cv::Mat& mask) {
  return cv::countNonZero(mask) == mask.rows * mask.cols;
}

}  // namespace

BodyBearing bearingFrom(const Eigen::Vector2d& camera_m, const Eigen::Vector2d& position_m) {
  const Eigen::Vector2d offset = position_m - camera_m;
  return {std::atan2(offset.y(), offset.x()), offset.norm()};
}

std::optional<BodyMatch> matchBody(const Panorama& panorama, const cv::Mat& before, const cv::Mat& now,
                                   const BodyBearing& seen_before, const BodyBearing& expected_now,
                                   double camera_height_m, double body_height_m, double search_rad) {
  const double range_m = expected_now.range_m, pixel_rad = panorama.pixel_rad();
  const auto rowAt = [&](double height_m) {
    return static_cast<int>(panorama.rowOf((height_m - camera_height_m) / range_m));
  };
  const int half_width = static_cast<int>(0.5 * kWidth_m / range_m / pixel_rad);
  const int width = std::max(kMinWidth_px, 2 * half_width + 1), half = width / 2;
  const int top = std::max(0, rowAt(std::min(body_height_m, kMaxTop_m)));
  const int bottom = std::min(now.rows, rowAt(kBottom_m));
  const int search = std::max(kMinSearch_px, static_cast<int>(std::ceil(search_rad / pixel_rad)));
  const int middle = cvRound(panorama.columnOf(expected_now.azimuth_rad));
  const cv::Rect part(middle - half, top, width, bottom - top);
  const cv::Rect searched(part.x - search, top, width + 2 * search, part.height);
  if (part.height < kMinHeight_px || (searched & cv::Rect(cv::Point(), now.size())) != searched ||
      !isVisible(panorama.validMask()(searched))) {
    return std::nullopt;
  }
  // Things get larger about the horizon as they come nearer.
  const double scale = range_m / seen_before.range_m, horizon = panorama.rowOf(0.0);
  const cv::Matx23d before_from_part(scale, 0.0, panorama.columnOf(seen_before.azimuth_rad) - scale * half,
                                     0.0, scale, horizon + scale * (top - horizon));
  constexpr int kFlags = cv::INTER_LINEAR | cv::WARP_INVERSE_MAP;
  cv::Mat body, mask, scores;
  cv::warpAffine(before, body, before_from_part, part.size(), kFlags);
  cv::warpAffine(panorama.validMask(), mask, before_from_part, part.size(), kFlags);
  if (!isVisible(mask) || !hasTexture(body)) {
    return std::nullopt;
  }
  cv::matchTemplate(now(searched), body, scores, cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point at;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &at);
  if (at.x == 0 || at.x + 1 == scores.cols) {
    return std::nullopt;  // the maximum may lie beyond
  }
  const double left = scores.at<float>(0, at.x - 1), right = scores.at<float>(0, at.x + 1);
  const double fraction = peakOffset(left, best, right);
  const double column = panorama.columnOf(expected_now.azimuth_rad) - middle;  // of the body in its part
  return BodyMatch{(column - (at.x - search) - fraction) * pixel_rad, best};   // columns run clockwise
}

}  // namespace vcharge
