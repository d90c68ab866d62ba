#include "sweep_input.h"

#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Nodes this far from the packed image's ends count as unseen: interpolated positions lie between them, or a
// little beyond.
constexpr float kInset_px = 4.0f;

}  // namespace

Projection SweepNeighbour::projectionOf(const MeiCamera& camera) const {
  constexpr auto kMargin = static_cast<float>(PackedImage::kMargin);
  Projection p;
  p.fx = static_cast<float>(camera.gamma1());
  p.fy = static_cast<float>(camera.gamma2());
  p.cx = static_cast<float>(camera.u0()) + kMargin;
  p.cy = static_cast<float>(camera.v0()) + kMargin;
  p.xi = static_cast<float>(camera.xi());
  p.min_x = kInset_px;
  p.min_y = kInset_px;
  p.max_x = static_cast<float>(image.size().width - 1) - kInset_px;
  p.max_y = static_cast<float>(image.size().height - 1) - kInset_px;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      p.rotation[3 * i + j] = neighbour_from_reference(i, j);
    }
    p.translation[i] = translation_m[i];
  }
  return p;
}

SweepReference::SweepReference(const cv::Mat& pixels, const PlaneSweepOptions& options,
                               const SampleScale& scale)
    : samples(pixels.size(), CV_16SC1),
      mean(pixels.size(), CV_32FC1, cv::Scalar(0.0f)),
      inverse_deviation(pixels.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN())) {
  cv::Mat table(1, 256, CV_16SC1);
  for (int gray = 0; gray < 256; ++gray) {
    table.at<int16_t>(gray) = static_cast<int16_t>(scale.sample(gray));
  }
  for (int y = 0; y < pixels.rows; ++y) {
    const auto* from = pixels.ptr<uint8_t>(y);
    auto* to = samples.ptr<int16_t>(y);
    for (int x = 0; x < pixels.cols; ++x) {
      to[x] = table.at<int16_t>(from[x]);
    }
  }
  const int window = options.window_px;
  const int radius = window / 2;
  const int count = window * window;
  const double per_gray = static_cast<double>(kWeightSum * kWeightSum) / (1 << scale.shift);
  const double min_squares =
      std::max(static_cast<double>(scale.min_squares), count * std::pow(options.min_texture * per_gray, 2.0));
  if (pixels.rows < window || pixels.cols < window) {
    return;
  }
  // Sums over a window of rows, per column; then over a window of columns.
  const auto columns = static_cast<size_t>(pixels.cols);
  std::vector<int32_t> sums(columns, 0), squares(columns, 0);
  const auto addRow = [&](int y, int sign) {
    const auto* row = samples.ptr<int16_t>(y);
    for (size_t x = 0; x < columns; ++x) {
      sums[x] += sign * row[x];
      squares[x] += sign * row[x] * row[x];
    }
  };
  for (int y = 0; y < pixels.rows; ++y) {
    addRow(y, 1);
    if (y < window - 1) {
      continue;
    }
    auto* mean_row = mean.ptr<float>(y - radius) + radius;
    auto* inverse_row = inverse_deviation.ptr<float>(y - radius) + radius;
    int64_t sum = 0, square = 0;
    for (int x = 0; x < pixels.cols; ++x) {
      sum += sums[static_cast<size_t>(x)];
      square += squares[static_cast<size_t>(x)];
      if (x >= window - 1) {
        const int start = x + 1 - window;
        const double about_mean = static_cast<double>(count * square - sum * sum) / count;
        mean_row[start] = static_cast<float>(sum) / static_cast<float>(count);
        if (about_mean >= min_squares) {
          inverse_row[start] = static_cast<float>(1.0 / std::sqrt(about_mean));
        }
        sum -= sums[static_cast<size_t>(start)];
        square -= squares[static_cast<size_t>(start)];
      }
    }
    addRow(y + 1 - window, -1);
  }
}

cv::Mat windowsInside(const cv::Mat& counts, int window_px) {
  cv::Mat inside;
  cv::erode(counts, inside, cv::Mat::ones(window_px, window_px, CV_8UC1), cv::Point(-1, -1), 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  return inside;
}

}  // namespace vcharge
