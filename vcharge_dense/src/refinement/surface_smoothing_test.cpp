#include "refinement/surface_smoothing.h"

#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "kernels/pooled_mat.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
const cv::Size kSize(101, 75);  // odd and not a multiple of a band

bool sameBytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

TEST(SurfaceSmoothingTest, FillsUnknownValuesFromTheirNeighbourhood) {
  cv::Mat values(kSize, CV_32FC1);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      const bool in_hole = x >= 30 && x < 60 && y >= 20 && y < 50;
      values.at<float>(y, x) = in_hole || y >= 70 ? kNaN : x < 45 ? 1.0f : 3.0f;
    }
  }
  const cv::Mat filled = fillUnknown(values);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      const float known = values.at<float>(y, x), value = filled.at<float>(y, x);
      if (known == known) {
        EXPECT_EQ(value, known);
      } else {
        EXPECT_GE(value, 1.0f);
        EXPECT_LE(value, 3.0f);
      }
    }
  }
  // At the left and right ends of the hole.
  EXPECT_EQ(filled.at<float>(35, 30), 1.0f);
  EXPECT_EQ(filled.at<float>(35, 59), 3.0f);
}

TEST(SurfaceSmoothingTest, OneKnownValueFillsAllAndNoneFillsNothing) {
  cv::Mat values(kSize, CV_32FC1, cv::Scalar(kNaN));
  EXPECT_EQ(cv::countNonZero(fillUnknown(values) == 0.25f), 0);
  values.at<float>(74, 100) = 0.25f;
  EXPECT_EQ(cv::countNonZero(fillUnknown(values) == 0.25f), kSize.area());
}

TEST(SurfaceSmoothingTest, MedianDoesNotDependOnBands) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> uniform(0.1f, 2.0f);
  cv::Mat values(kSize, CV_32FC1);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      values.at<float>(y, x) = uniform(generator);
    }
  }
  cv::Mat median;
  cv::medianBlur(values, median, 5);
  // With such small steps only equal neighbours contribute to the mean.
  const cv::Mat smooth = smoothSurface(sweepKernels(), values, cv::Mat(kSize, CV_32FC1, cv::Scalar(1e-12f)));
  EXPECT_LT(cv::norm(smooth, median, cv::NORM_INF), 1e-6);
  EXPECT_GT(cv::norm(values, median, cv::NORM_INF), 0.5);
}

TEST(PooledMatTest, NoTwoMatricesShareMemoryAtATime) {
  tbb::parallel_for(0, 64, [](int i) {
    std::vector<cv::Mat> mats;
    for (int k = 0; k < 8; ++k) {
      mats.push_back(pooledMat(kSize, CV_32SC1));
      mats.back().setTo(8 * i + k);
    }
    for (int k = 0; k < 8; ++k) {
      const cv::Mat expected(kSize, CV_32SC1, cv::Scalar(8 * i + k));
      EXPECT_TRUE(sameBytes(mats[static_cast<size_t>(k)], expected));
    }
  });
}

TEST(PooledMatTest, MemoryIsReused) {
  const cv::Size unusual(53, 17);
  const uint8_t* first = nullptr;
  {
    const cv::Mat mat = pooledMat(unusual, CV_32FC1);
    const cv::Mat other_header = mat;
    first = mat.data;
  }
  EXPECT_EQ(pooledMat(unusual, CV_32FC1).data, first);
}

}  // namespace
}  // namespace vcharge
