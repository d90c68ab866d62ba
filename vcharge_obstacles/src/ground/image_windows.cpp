#include "ground/image_windows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

VCHARGE_WIDE_LOOPS void addValues(const uint8_t* a, int sign, int columns, int32_t* sums) {
  for (int x = 0; x < columns; ++x) {
    sums[x] += sign * a[x];
  }
}

VCHARGE_WIDE_LOOPS void addProducts(const uint8_t* a, const uint8_t* b, int columns, int32_t* sums) {
  for (int x = 0; x < columns; ++x) {
    sums[x] += a[x] * b[x];
  }
}

VCHARGE_WIDE_LOOPS void subtractProducts(const uint8_t* a, const uint8_t* b, int columns, int32_t* sums) {
  for (int x = 0; x < columns; ++x) {
    sums[x] -= a[x] * b[x];
  }
}

template <int kSide>
[[gnu::always_inline]] inline void slideWindows(const int32_t* of_column, int columns, int32_t* of_window) {
  for (int x = 0; x < columns; ++x) {
    int32_t sum = of_column[x];
    for (int i = 1; i < kSide; ++i) {
      sum += of_column[x + i];
    }
    of_window[x] = sum;
  }
}

VCHARGE_WIDE_LOOPS void slideWindowsOf5(const int32_t* of_column, int columns, int32_t* of_window) {
  slideWindows<5>(of_column, columns, of_window);
}

VCHARGE_WIDE_LOOPS void slideWindowsOf9(const int32_t* of_column, int columns, int32_t* of_window) {
  slideWindows<9>(of_column, columns, of_window);
}

VCHARGE_WIDE_LOOPS void findMoments(const int32_t* count, const int32_t* sums, const int32_t* squares,
                                    int columns, float* mean, float* variance) {
  for (int x = 0; x < columns; ++x) {
    const float part = 1.0F / static_cast<float>(count[x]);
    mean[x] = static_cast<float>(sums[x]) * part;
    variance[x] = static_cast<float>(count[x] * squares[x] - sums[x] * sums[x]) * (part * part);
  }
}

/// Sums and variances of the windows of one image.
struct WindowMoments {
  const int32_t* sums;
  const float* variance;
};

VCHARGE_WIDE_LOOPS void correlate(const int32_t* count, const int32_t* products, const WindowMoments& here,
                                  const WindowMoments& there, int columns, float* correlation) {
  const int32_t *here_sums = here.sums, *there_sums = there.sums;
  const float *here_variance = here.variance, *there_variance = there.variance;
  for (int x = 0; x < columns; ++x) {
    const int32_t covariance = count[x] * products[x] - here_sums[x] * there_sums[x];
    const float a = here_variance[x] > 1.0F ? here_variance[x] : 1.0F;
    const float b = there_variance[x] > 1.0F ? there_variance[x] : 1.0F;
    const auto squared_count = static_cast<float>(count[x] * count[x]);
    correlation[x] = static_cast<float>(covariance) / (squared_count * std::sqrt(a * b));
  }
}

}  // namespace

WindowSums::WindowSums(int columns, int half_px)
    : columns_(columns),
      half_px_(half_px),
      of_column_(static_cast<size_t>(columns) + 2 * static_cast<size_t>(half_px), 0),
      of_window_(static_cast<size_t>(columns), 0) {}

void WindowSums::add(Row entering, Row leaving) {
  int32_t* sums = of_column_.data() + half_px_;
  if (entering.a != nullptr && entering.b != nullptr) {
    addProducts(entering.a, entering.b, columns_, sums);
  } else if (entering.a != nullptr) {
    addValues(entering.a, 1, columns_, sums);
  }
  if (leaving.a != nullptr && leaving.b != nullptr) {
    subtractProducts(leaving.a, leaving.b, columns_, sums);
  } else if (leaving.a != nullptr) {
    addValues(leaving.a, -1, columns_, sums);
  }
}

void WindowSums::slide() {
  switch (half_px_) {  // loops of a known length vectorize
    case 2:
      return slideWindowsOf5(of_column_.data(), columns_, of_window_.data());
    case 4:
      return slideWindowsOf9(of_column_.data(), columns_, of_window_.data());
    default:
      for (int x = 0; x < columns_; ++x) {
        int32_t sum = 0;
        for (int i = 0; i <= 2 * half_px_; ++i) {
          sum += of_column_[static_cast<size_t>(x) + static_cast<size_t>(i)];
        }
        of_window_[static_cast<size_t>(x)] = sum;
      }
  }
}

ImageWindows::ImageWindows(const cv::Mat& now, std::vector<cv::Mat> before, int half_px)
    : now_(now),
      before_(std::move(before)),
      half_px_(half_px),
      here_{WindowSums(now.cols, half_px), WindowSums(now.cols, half_px), {}, {}} {
  const auto columns = static_cast<size_t>(now.cols);
  for (int x = 0; x < now.cols; ++x) {
    columns_in_window_.push_back(std::min(x + half_px, now.cols - 1) - std::max(x - half_px, 0) + 1);
  }
  count_.resize(columns);
  here_.mean.resize(columns);
  here_.variance.resize(columns);
  there_.assign(before_.size(), here_);
  pairs_.assign(before_.size(), {WindowSums(now.cols, half_px), std::vector<float>(columns)});
  for (int row = 0; row < std::min(half_px, now.rows); ++row) {
    addRow(row, -1);
  }
}

void ImageWindows::addRow(int entering, int leaving) {
  const auto rowOf = [](const cv::Mat& image, int row) {
    return row < 0 || row >= image.rows ? nullptr : image.ptr<uint8_t>(row);
  };
  const uint8_t* here_in = rowOf(now_, entering);
  const uint8_t* here_out = rowOf(now_, leaving);
  here_.sums.add({here_in, nullptr}, {here_out, nullptr});
  here_.squares.add({here_in, here_in}, {here_out, here_out});
  for (size_t i = 0; i < before_.size(); ++i) {
    const uint8_t* there_in = rowOf(before_[i], entering);
    const uint8_t* there_out = rowOf(before_[i], leaving);
    there_[i].sums.add({there_in, nullptr}, {there_out, nullptr});
    there_[i].squares.add({there_in, there_in}, {there_out, there_out});
    pairs_[i].products.add({here_in, there_in}, {here_out, there_out});
  }
}

void ImageWindows::setMoments(Moments* moments) const {
  moments->sums.slide();
  moments->squares.slide();
  findMoments(count_.data(), moments->sums.data(), moments->squares.data(), now_.cols, moments->mean.data(),
              moments->variance.data());
}

void ImageWindows::nextRow() {
  ++row_;
  addRow(row_ + half_px_, row_ - half_px_ - 1);
  const int rows = std::min(row_ + half_px_, now_.rows - 1) - std::max(row_ - half_px_, 0) + 1;
  const int columns = now_.cols;
  int32_t* count = count_.data();
  const int32_t* columns_in_window = columns_in_window_.data();
  for (int x = 0; x < columns; ++x) {
    count[x] = rows * columns_in_window[x];
  }
  setMoments(&here_);
  for (size_t i = 0; i < before_.size(); ++i) {
    setMoments(&there_[i]);
    pairs_[i].products.slide();
    correlate(count_.data(), pairs_[i].products.data(), {here_.sums.data(), here_.variance.data()},
              {there_[i].sums.data(), there_[i].variance.data()}, columns, pairs_[i].correlation.data());
  }
}

}  // namespace vcharge
