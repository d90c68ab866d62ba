#include "bodies/body_stereo.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "bodies/body_part.h"

namespace vcharge {
namespace {

// Ranges that are searched, relative to the expected one; least range from the second camera, and sine of the
// angle between the lines of sight from which they tell a range.
constexpr double kNearest = 0.78, kFarthest = 1.28, kMinRange_m = 1.0, kMinParallax = 0.1;
// Part of a body that is compared, below its top: legs swing, and show what is behind them.
constexpr double kWidth_m = 0.44, kBottom = 0.3, kMaxTop_m = 1.8;
constexpr int kMinRows = 10;
// Least correlation, and its least excess over that of all ranges beyond so many pixels of the second view.
constexpr double kMinCorrelation = 0.45, kMinExcess = 0.1;
constexpr int kPeak_px = 3;
// Pixels up or down that are searched: errors of the calibration.
constexpr int kVertical_px = 1;
// Errors of a match: in pixels, and since two cameras see two sides of a body.
constexpr double kMatch_px = 0.7, kSides_m = 0.03;

/// A part of a panorama, of which a pixel is `step` pixels, around a column, from a row downwards. Empty if a
/// tenth of it is not visible, or without texture.
cv::Mat cut(const PanoramaView& view, double column, double top_row, double step, const cv::Size& size) {
  const double left = column - step * 0.5 * (size.width - 1);
  if (left < 0.0 || top_row < 0.0 || left + step * (size.width - 1) > view.image.cols - 1.0 ||
      top_row + step * (size.height - 1) > view.image.rows - 1.0) {
    return {};
  }
  // Every other row and column tells how much of it is visible.
  int visible = 0, looked_at = 0;
  for (int y = 0; y < size.height; y += 2) {
    const auto* row = view.panorama.validMask().ptr<uint8_t>(cvRound(top_row + y * step));
    for (int x = 0; x < size.width; x += 2) {
      visible += row[cvRound(left + x * step)] != 0 ? 1 : 0;
      ++looked_at;
    }
  }
  if (10 * visible < 9 * looked_at) {
    return {};
  }
  cv::Mat part;
  cv::warpAffine(view.image, part, cv::Matx23d(step, 0.0, left, 0.0, step, top_row), size,
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  return hasTexture(part) ? part : cv::Mat();
}

/// Normalized correlation of a body with the rows of a part from `first_row` on; both have texture.
double correlate(const cv::Mat& part, int first_row, const cv::Mat& body) {
  int64_t a_sum = 0, b_sum = 0, aa_sum = 0, bb_sum = 0, ab_sum = 0;
  for (int y = 0; y < body.rows; ++y) {
    const auto* a = part.ptr<uint8_t>(first_row + y);
    const auto* b = body.ptr<uint8_t>(y);
    int32_t row_a = 0, row_b = 0, row_aa = 0, row_bb = 0, row_ab = 0;
    for (int x = 0; x < body.cols; ++x) {
      row_a += a[x];
      row_b += b[x];
      row_aa += a[x] * a[x];
      row_bb += b[x] * b[x];
      row_ab += a[x] * b[x];
    }
    a_sum += row_a;
    b_sum += row_b;
    aa_sum += row_aa;
    bb_sum += row_bb;
    ab_sum += row_ab;
  }
  const auto count = static_cast<int64_t>(body.total());
  const auto variances = static_cast<double>(count * aa_sum - a_sum * a_sum) *
                         static_cast<double>(count * bb_sum - b_sum * b_sum);
  return variances > 0.0 ? static_cast<double>(count * ab_sum - a_sum * b_sum) / std::sqrt(variances) : 0.0;
}

/// Compares a body with a second view at any range.
class RangeSweep {
 public:
  RangeSweep(const PanoramaView& first, const PanoramaView& second, const BodyBearing& expected,
             double body_height_m)
      : first_(first), second_(second), expected_(expected) {
    const BodyBearing in_second = seenAt(expected.range_m);
    parallax_ = std::abs(std::sin(in_second.azimuth_rad - expected.azimuth_rad));
    if (parallax_ < kMinParallax || in_second.range_m < kMinRange_m) {
      return;
    }
    pixel_m_ = std::max(expected.range_m * first.panorama.pixel_rad(),
                        in_second.range_m * second.panorama.pixel_rad());
    const double top_m = std::min(body_height_m, kMaxTop_m);
    top_slope_ = (top_m - first.camera_in_vehicle_m.z()) / expected.range_m;
    const cv::Size size(2 * static_cast<int>(0.5 * kWidth_m / pixel_m_) + 1,
                        static_cast<int>((top_m - kBottom * body_height_m) / pixel_m_));
    if (size.height >= kMinRows) {
      body_ = cut(first, first.panorama.columnOf(expected.azimuth_rad), first.panorama.rowOf(top_slope_),
                  pixel_m_ / (expected.range_m * first.panorama.pixel_rad()), size);
    }
    // Successive ranges differ by a pixel of the second view.
    const double step = pixel_m_ / in_second.range_m / parallax_;
    count_ = std::max(2 * kPeak_px + 3, static_cast<int>(std::log(kFarthest / kNearest) / step));
  }

  bool isPossible() const { return !body_.empty(); }
  int count() const { return count_; }
  double rangeAt(double index) const {
    return expected_.range_m * kNearest * std::pow(kFarthest / kNearest, index / (count_ - 1.0));
  }
  /// Correlation at a range; -1 where the second view does not tell.
  double compareAt(double range_m) const {
    const BodyBearing seen = seenAt(range_m);
    const double step =
        pixel_m_ * range_m / expected_.range_m / (seen.range_m * second_.panorama.pixel_rad());
    const double top_m = first_.camera_in_vehicle_m.z() + top_slope_ * range_m;
    const double top_row = second_.panorama.rowOf((top_m - second_.camera_in_vehicle_m.z()) / seen.range_m);
    const cv::Mat part =
        cut(second_, second_.panorama.columnOf(seen.azimuth_rad), top_row - kVertical_px * step, step,
            body_.size() + cv::Size(0, 2 * kVertical_px));
    if (part.empty()) {
      return -1.0;
    }
    double best = -1.0;
    for (int row = 0; row <= 2 * kVertical_px; ++row) {
      best = std::max(best, correlate(part, row, body_));
    }
    return best;
  }
  double sigma_m() const { return std::hypot(kMatch_px * pixel_m_, kSides_m) / parallax_; }

 private:
  BodyBearing seenAt(double range_m) const {
    const Eigen::Vector2d direction(std::cos(expected_.azimuth_rad), std::sin(expected_.azimuth_rad));
    return bearingFrom(second_.camera_in_vehicle_m.head<2>(),
                       first_.camera_in_vehicle_m.head<2>() + range_m * direction);
  }

  const PanoramaView& first_;
  const PanoramaView& second_;
  const BodyBearing expected_;
  double parallax_ = 0.0, pixel_m_ = 0.0, top_slope_ = 0.0;
  int count_ = 0;
  cv::Mat body_;
};

}  // namespace

std::optional<StereoRange> matchBodyRange(const PanoramaView& first, const PanoramaView& second,
                                          const BodyBearing& expected, double body_height_m) {
  const RangeSweep sweep(first, second, expected, body_height_m);
  if (!sweep.isPossible()) {
    return std::nullopt;
  }
  std::vector<double> scores;
  for (int i = 0; i < sweep.count(); ++i) {
    scores.push_back(sweep.compareAt(sweep.rangeAt(i)));
  }
  const auto best = std::max_element(scores.begin(), scores.end());
  if (best == scores.begin() || best + 1 == scores.end() || *best < kMinCorrelation) {
    return std::nullopt;
  }
  for (auto score = scores.begin(); score != scores.end(); ++score) {
    if (std::abs(score - best) > kPeak_px && *score > *best - kMinExcess) {
      return std::nullopt;
    }
  }
  const double index = static_cast<double>(best - scores.begin()) + peakOffset(best[-1], *best, best[1]);
  return StereoRange{sweep.rangeAt(index), sweep.sigma_m()};
}

}  // namespace vcharge
