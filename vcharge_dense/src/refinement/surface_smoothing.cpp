#include "refinement/surface_smoothing.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Halves the size: mean of the known values in blocks of two by two.
cv::Mat meansOfKnown(const cv::Mat& values) {
  cv::Mat means = pooledMat({(values.cols + 1) / 2, (values.rows + 1) / 2}, CV_32FC1);
  forEachRow(means.rows, [&](int y) {
    const auto* above = values.ptr<float>(2 * y);
    const auto* below = values.ptr<float>(std::min(2 * y + 1, values.rows - 1));
    auto* out = means.ptr<float>(y);
    for (int x = 0; x < means.cols; ++x) {
      const int right = std::min(2 * x + 1, values.cols - 1);
      float sum = 0.0f, count = 0.0f;
      for (const float value : {above[2 * x], above[right], below[2 * x], below[right]}) {
        const bool known = value == value;  // NaN differs from itself
        sum += known ? value : 0.0f;
        count += known ? 1.0f : 0.0f;
      }
      out[x] = count > 0.0f ? sum / count : kNaN;
    }
  });
  return means;
}

cv::Mat medianOf5x5(const cv::Mat& values) {
  constexpr int kRadius = 2;
  cv::Mat median = pooledMat(values.size(), CV_32FC1);
  forEachBand(values.rows, [&](int begin, int end) {
    const int first = std::max(0, begin - kRadius);
    cv::Mat band;
    cv::medianBlur(values.rowRange(first, std::min(values.rows, end + kRadius)), band, 2 * kRadius + 1);
    cv::Mat out = median.rowRange(begin, end);
    band.rowRange(begin - first, end - first).copyTo(out);
  });
  return median;
}

}  // namespace

cv::Mat fillUnknown(const cv::Mat& values) {
  std::vector<cv::Mat> means{values};
  while (means.back().rows > 1 || means.back().cols > 1) {
    means.push_back(meansOfKnown(means.back()));
  }
  cv::Mat coarse = means.back();
  for (size_t level = means.size() - 1; level-- > 0;) {
    cv::Mat filled = pooledMat(means[level].size(), CV_32FC1);
    forEachRow(filled.rows, [&](int y) {
      const auto* known = means[level].ptr<float>(y);
      const auto* from = coarse.ptr<float>(y / 2);
      auto* out = filled.ptr<float>(y);
      for (int x = 0; x < filled.cols; ++x) {
        out[x] = known[x] == known[x] ? known[x] : from[x / 2];
      }
    });
    coarse = filled;
  }
  return coarse;
}

cv::Mat smoothSurface(const SweepKernels& kernels, const cv::Mat& inverse_range, const cv::Mat& step) {
  constexpr int kRadius = 4, kStep = 2;
  const cv::Mat median = medianOf5x5(fillUnknown(inverse_range));
  cv::Mat padded = pooledMat({median.cols + 2 * kRadius, median.rows}, CV_32FC1);
  forEachRow(median.rows,
             [&](int y) { copyPadded(median.ptr<float>(y), median.cols, kRadius, padded.ptr<float>(y)); });
  cv::Mat smooth = pooledMat(median.size(), CV_32FC1);
  forEachRow(smooth.rows, [&](int y) {
    std::vector<const float*> rows;
    for (int v = std::max(0, y - kRadius); v <= std::min(smooth.rows - 1, y + kRadius); v += kStep) {
      rows.push_back(padded.ptr<float>(v) + kRadius);
    }
    const auto columns = static_cast<size_t>(smooth.cols);
    std::vector<float> number(columns), sum(columns);
    kernels.sumAgreeing({columns, rows.data(), static_cast<int>(rows.size()), kRadius, kStep,
                         median.ptr<float>(y), step.ptr<float>(y)},
                        number.data(), sum.data());
    const auto* middle = median.ptr<float>(y);
    auto* row = smooth.ptr<float>(y);
    for (size_t x = 0; x < columns; ++x) {
      row[x] = number[x] > 0.0f ? sum[x] / number[x] : middle[x];
    }
  });
  return smooth;
}

}  // namespace vcharge
