#include "sweep/sweep_input.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"
#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

// Nodes closer than this to the packed image's borders are unseen, because interpolated positions may lie a
// little outside their nodes.
constexpr float kInset_px = 4.0f;

LineMotion lineMotion(const Exposure& exposure, const Eigen::Matrix3f& axes) {
  const Eigen::Vector3f velocity = axes * exposure.velocity_m_per_s.cast<float>();
  const Eigen::Vector3f turn_rate = axes * exposure.turn_rate_rad_per_s.cast<float>();
  LineMotion motion;
  motion.lines_are_columns = exposure.times.lines_are_columns;
  Eigen::Map<Eigen::Vector4f>(motion.times_s) = exposure.times.coefficients_s.cast<float>();
  Eigen::Map<Eigen::Vector3f>(motion.velocity) = velocity;
  Eigen::Map<Eigen::Vector3f>(motion.turn_rate) = turn_rate;
  return motion;
}

/// Computes the reference's mean and inverse deviation in the rows `begin` to `end`.
VCHARGE_WIDE_LOOPS void findMoments(int begin, int end, int window, double min_squares,
                                    SweepReference* reference) {
  const cv::Mat& samples = reference->samples;
  const int radius = window / 2;
  const double count = window * window;
  const auto per_count = static_cast<float>(1.0 / count);
  const auto columns = static_cast<size_t>(samples.cols);
  // Sums over a window of rows for each column, then over a window of columns that starts at each column.
  std::vector<int32_t> sums(columns, 0), squares(columns, 0), sum(columns), square(columns);
  const auto addRow = [&](int y, int sign) {
    const auto* row = samples.ptr<int16_t>(y);
    for (size_t x = 0; x < columns; ++x) {
      sums[x] += sign * row[x];
      squares[x] += sign * row[x] * row[x];
    }
  };
  bool has_sums = false;
  for (int y = begin; y < end; ++y) {
    auto* mean_row = reference->mean.ptr<float>(y);
    auto* inverse_row = reference->inverse_deviation.ptr<float>(y);
    std::fill_n(mean_row, columns, 0.0f);
    std::fill_n(inverse_row, columns, std::numeric_limits<float>::quiet_NaN());
    if (y < radius || y + radius >= samples.rows || samples.cols < window) {
      continue;
    }
    if (has_sums) {
      addRow(y - radius - 1, -1);
      addRow(y + radius, 1);
    }
    for (int v = y - radius; v <= y + radius && !has_sums; ++v) {
      addRow(v, 1);
    }
    has_sums = true;
    const size_t num_windows = columns + 1 - static_cast<size_t>(window);
    std::fill(sum.begin(), sum.end(), 0);
    std::fill(square.begin(), square.end(), 0);
    for (size_t i = 0; i < static_cast<size_t>(window); ++i) {
      for (size_t x = 0; x < num_windows; ++x) {
        sum[x] += sums[x + i];
        square[x] += squares[x + i];
      }
    }
    mean_row += radius;
    inverse_row += radius;
    for (size_t x = 0; x < num_windows; ++x) {
      const double total = sum[x];
      const double about_mean = square[x] - total * total / count;
      const float inverse = 1.0f / std::sqrt(static_cast<float>(about_mean));
      mean_row[x] = static_cast<float>(total) * per_count;
      inverse_row[x] = about_mean >= min_squares ? inverse : std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace

Projection SweepNeighbour::projection() const {
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
  p.is_moving = exposure.moves() || reference_exposure.moves();
  p.reference_xi = static_cast<float>(reference_xi);
  p.reference = lineMotion(reference_exposure, neighbour_from_reference);
  p.neighbour = lineMotion(exposure, Eigen::Matrix3f::Identity());
  Eigen::Map<Eigen::Vector3f>(p.neighbour.velocity) +=
      exposure.turn_rate_rad_per_s.cast<float>().cross(translation_m);
  return p;
}

SweepReference::SweepReference(const cv::Mat& pixels, const PlaneSweepOptions& options,
                               const SampleScale& scale)
    : samples(pooledMat(pixels.size(), CV_16SC1)),
      mean(pooledMat(pixels.size(), CV_32FC1)),
      inverse_deviation(pooledMat(pixels.size(), CV_32FC1)) {
  int16_t table[256];
  for (int gray = 0; gray < 256; ++gray) {
    table[gray] = static_cast<int16_t>(scale.sample(gray));
  }
  forEachRow(pixels.rows, [&](int y) {
    const auto* from = pixels.ptr<uint8_t>(y);
    auto* to = samples.ptr<int16_t>(y);
    for (int x = 0; x < pixels.cols; ++x) {
      to[x] = table[from[x]];
    }
  });
  const int window = kMatchingWindow_px;
  const int count = window * window;
  const double per_gray = static_cast<double>(kWeightSum * kWeightSum) / (1 << scale.shift);
  const double min_squares =
      std::max(static_cast<double>(scale.min_squares), count * std::pow(options.min_texture * per_gray, 2.0));
  forEachBand(pixels.rows, [&](int begin, int end) { findMoments(begin, end, window, min_squares, this); });
}

cv::Mat windowsInside(const cv::Mat& counts, int window_px) {
  cv::Mat inside;
  cv::erode(counts, inside, cv::Mat::ones(window_px, window_px, CV_8UC1), cv::Point(-1, -1), 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  return inside;
}

}  // namespace vcharge
