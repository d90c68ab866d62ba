#include "ground/plane_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vcharge {
namespace {

// A larger window must show the ground too: small windows of a body fit by chance now and then.
constexpr int kHalf_px = PlaneFit::kWindow_px / 2, kWideHalf_px = 4;
// Standard deviation in gray levels from which a window has texture.
constexpr float kTexture = 1.2F;
// Correlations from which a window shows the plane, up to which it does not, and the least difference between
// two planes that decides.
constexpr float kSame = 0.7F, kOther = 0.4F, kDecisive = 0.15F;

/// Sums over the windows along one row of one image, or of the products of two.
class RowSums {
 public:
  RowSums(int columns, int half_px)
      : half_px_(half_px),
        of_column_(static_cast<size_t>(columns)),
        of_window_(static_cast<size_t>(columns)) {}
  /// Adds a row of an image to the columns; with sign -1, takes it away.
  void add(const uint8_t* image, int sign) {
    int32_t* sums = of_column_.data();
    const size_t count = of_column_.size();
    for (size_t x = 0; x < count; ++x) {
      sums[x] += sign * image[x];
    }
  }
  void addProducts(const uint8_t* a, const uint8_t* b, int sign) {
    int32_t* sums = of_column_.data();
    const size_t count = of_column_.size();
    for (size_t x = 0; x < count; ++x) {
      sums[x] += sign * a[x] * b[x];
    }
  }
  /// Sums the columns of each window.
  void slide() {
    const int columns = static_cast<int>(of_column_.size());
    int32_t sum = 0;
    for (int x = -half_px_; x < columns; ++x) {
      sum += x + half_px_ < columns ? of_column_[static_cast<size_t>(x + half_px_)] : 0;
      if (x >= 0) {
        of_window_[static_cast<size_t>(x)] = sum;
        sum -= x >= half_px_ ? of_column_[static_cast<size_t>(x - half_px_)] : 0;
      }
    }
  }
  int32_t at(int x) const { return of_window_[static_cast<size_t>(x)]; }

 private:
  int half_px_;
  std::vector<int32_t> of_column_, of_window_;
};

/// Variances and correlations of the windows of an image and of older ones, row by row.
class Windows {
 public:
  Windows(const cv::Mat& now, const std::vector<cv::Mat>& before, int half_px)
      : now_(now),
        before_(before),
        half_px_(half_px),
        here_(now.cols, half_px),
        here_squared_(here_),
        there_(before.size(), here_),
        there_squared_(there_),
        products_(there_) {
    for (int row = 0; row < std::min(half_px, now.rows); ++row) {
      add(row, 1);
    }
  }
  void nextRow() {
    ++row_;
    if (row_ + half_px_ < now_.rows) {
      add(row_ + half_px_, 1);
    }
    if (row_ > half_px_) {
      add(row_ - half_px_ - 1, -1);
    }
    here_.slide();
    here_squared_.slide();
    for (size_t i = 0; i < before_.size(); ++i) {
      there_[i].slide();
      there_squared_[i].slide();
      products_[i].slide();
    }
  }
  float variance(int x) const { return variance(here_, here_squared_, x); }
  float varianceBefore(size_t i, int x) const { return variance(there_[i], there_squared_[i], x); }
  float correlation(size_t i, int x) const {
    const int32_t count = countAt(x);
    const int32_t covariance = count * products_[i].at(x) - here_.at(x) * there_[i].at(x);
    return static_cast<float>(covariance) / static_cast<float>(count * count) /
           std::sqrt(std::max(1.0F, variance(x)) * std::max(1.0F, varianceBefore(i, x)));
  }

 private:
  void add(int row, int sign) {
    const auto* here = now_.ptr<uint8_t>(row);
    here_.add(here, sign);
    here_squared_.addProducts(here, here, sign);
    for (size_t i = 0; i < before_.size(); ++i) {
      const auto* there = before_[i].ptr<uint8_t>(row);
      there_[i].add(there, sign);
      there_squared_[i].addProducts(there, there, sign);
      products_[i].addProducts(here, there, sign);
    }
  }
  int32_t countAt(int x) const {
    return (std::min(row_ + half_px_, now_.rows - 1) - std::max(row_ - half_px_, 0) + 1) *
           (std::min(x + half_px_, now_.cols - 1) - std::max(x - half_px_, 0) + 1);
  }
  float variance(const RowSums& sums, const RowSums& squares, int x) const {
    const int32_t count = countAt(x);
    return static_cast<float>(count * squares.at(x) - sums.at(x) * sums.at(x)) /
           static_cast<float>(count * count);
  }

  const cv::Mat now_;
  const std::vector<cv::Mat> before_;
  const int half_px_;
  int row_ = -1;
  RowSums here_, here_squared_;
  std::vector<RowSums> there_, there_squared_, products_;
};

}  // namespace

cv::Mat fitPlanes(const cv::Mat& now, const cv::Mat& on_ground, const cv::Mat& on_raised,
                  const cv::Mat& knows_raised) {
  constexpr size_t kOnGround = 0, kOnRaised = 1;
  Windows windows(now, {on_ground, on_raised}, kHalf_px), wide(now, {on_ground}, kWideHalf_px);
  cv::Mat fits(now.size(), CV_8UC1, cv::Scalar(PlaneFit::kUndecided));
  for (int row = 0; row < now.rows; ++row) {
    windows.nextRow();
    wide.nextRow();
    const auto* knows = knows_raised.ptr<uint8_t>(row);
    auto* result = fits.ptr<uint8_t>(row);
    for (int x = 0; x < now.cols; ++x) {
      if (std::min(windows.variance(x), windows.varianceBefore(kOnGround, x)) < kTexture * kTexture) {
        continue;
      }
      const float fit = windows.correlation(kOnGround, x);
      const float raised = knows[x] != 0 ? windows.correlation(kOnRaised, x) : 1.0F;
      if (fit < kOther || raised >= fit + kDecisive) {
        result[x] = PlaneFit::kOther;
      } else if (fit >= kSame && fit >= raised + kDecisive && wide.correlation(kOnGround, x) >= kSame) {
        result[x] = PlaneFit::kGround;
      }
    }
  }
  return fits;
}

cv::Mat keepsTexture(const cv::Mat& now, const cv::Mat& on_ground) {
  Windows windows(now, {on_ground}, kWideHalf_px);
  cv::Mat keeps(now.size(), CV_8UC1, cv::Scalar(0));
  for (int row = 0; row < now.rows; ++row) {
    windows.nextRow();
    auto* result = keeps.ptr<uint8_t>(row);
    for (int x = 0; x < now.cols; ++x) {
      if (windows.varianceBefore(0, x) >= kTexture * kTexture && windows.correlation(0, x) >= kOther) {
        result[x] = 255;
      }
    }
  }
  return keeps;
}

}  // namespace vcharge
