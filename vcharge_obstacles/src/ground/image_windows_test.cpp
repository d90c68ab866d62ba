#include "ground/image_windows.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

cv::Mat noise(cv::Size size, int seed) {
  cv::Mat image(size, CV_8UC1);
  cv::RNG random(static_cast<uint64_t>(seed));
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

struct Moments {
  double mean_a = 0.0, mean_b = 0.0, variance_a = 0.0, variance_b = 0.0, covariance = 0.0;

  /// Sums, pixel by pixel, over a window of two images that is cut off at their border.
  Moments(const cv::Mat& a, const cv::Mat& b, cv::Point middle, int half_px) {
    const cv::Rect window =
        cv::Rect(middle.x - half_px, middle.y - half_px, 2 * half_px + 1, 2 * half_px + 1) &
        cv::Rect(cv::Point(), a.size());
    const double count = window.area();
    for (int y = window.y; y < window.br().y; ++y) {
      for (int x = window.x; x < window.br().x; ++x) {
        const double value_a = a.at<uint8_t>(y, x), value_b = b.at<uint8_t>(y, x);
        mean_a += value_a / count;
        mean_b += value_b / count;
        variance_a += value_a * value_a / count;
        variance_b += value_b * value_b / count;
        covariance += value_a * value_b / count;
      }
    }
    variance_a -= mean_a * mean_a;
    variance_b -= mean_b * mean_b;
    covariance -= mean_a * mean_b;
  }
};

/// Compares every window of an image and two older ones with the sums over its pixels.
void checkAll(const cv::Mat& now, const std::vector<cv::Mat>& before, int half_px) {
  ImageWindows windows(now, before, half_px);
  for (int y = 0; y < now.rows; ++y) {
    windows.nextRow();
    for (int x = 0; x < now.cols; ++x) {
      for (size_t i = 0; i < before.size(); ++i) {
        const Moments expected(now, before[i], cv::Point(x, y), half_px);
        ASSERT_NEAR(windows.mean()[x], expected.mean_a, 1e-3);
        ASSERT_NEAR(windows.meanBefore(i)[x], expected.mean_b, 1e-3);
        ASSERT_NEAR(windows.variance()[x], expected.variance_a, 1e-4 * expected.variance_a + 0.02);
        ASSERT_NEAR(windows.varianceBefore(i)[x], expected.variance_b, 1e-4 * expected.variance_b + 0.02);
        const double scale =
            std::sqrt(std::max(1.0, expected.variance_a) * std::max(1.0, expected.variance_b));
        ASSERT_NEAR(windows.correlation(i)[x], expected.covariance / scale, 2e-3)
            << "window of half " << half_px << " at " << x << ", " << y;
      }
    }
  }
}

TEST(ImageWindowsTest, EqualSumsOverPixelsUpToTheBorder) {
  const cv::Mat now = noise(cv::Size(37, 23), 1);
  cv::Mat similar;
  cv::addWeighted(now, 0.7, noise(now.size(), 2), 0.3, 0.0, similar);
  for (const int half_px : {1, 2, 4}) {
    checkAll(now, {similar, noise(now.size(), 3)}, half_px);
  }
}

TEST(ImageWindowsTest, WindowsMayBeLargerThanTheImage) {
  const cv::Mat now = noise(cv::Size(3, 2), 4);
  checkAll(now, {noise(now.size(), 5)}, 4);
}

TEST(ImageWindowsTest, ConstantImagesHaveNoCorrelation) {
  const cv::Mat flat(12, 20, CV_8UC1, cv::Scalar(255));
  checkAll(flat, {flat, noise(flat.size(), 6)}, 2);
}

}  // namespace
}  // namespace vcharge
