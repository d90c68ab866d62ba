#include "vcharge_evaluation/range_truth.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {

cv::Mat readRangeTruth(const std::string& folder, const std::string& camera_name, Timestamp stamp) {
  const std::filesystem::path path =
      std::filesystem::path(folder) / camera_name / (std::to_string(stamp.nanoseconds()) + ".tiff");
  if (!std::filesystem::exists(path)) {
    return cv::Mat();
  }
  cv::Mat range = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  if (range.type() != CV_32FC1) {
    throw InputError(path.string() + ": expected a TIFF of 32-bit floats");
  }
  return range;
}

cv::Mat resampleRangeTruth(const cv::Mat& sensor_range_m, const WorkingCamera& working_camera) {
  check(sensor_range_m.type() == CV_32FC1, "resampleRangeTruth: expected CV_32FC1");
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kSameSurface = 1.05F;
  const cv::Mat& sensor_pixels = working_camera.sensorPixels();
  cv::Mat truth(working_camera.size(), CV_32FC1, cv::Scalar(kNan));
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const cv::Vec2f& pixel = sensor_pixels.at<cv::Vec2f>(y, x);
      if (pixel[0] < 0.0F) {
        continue;
      }
      const int x0 = std::clamp(static_cast<int>(pixel[0]), 0, sensor_range_m.cols - 1);
      const int y0 = std::clamp(static_cast<int>(pixel[1]), 0, sensor_range_m.rows - 1);
      const int x1 = std::min(x0 + 1, sensor_range_m.cols - 1);
      const int y1 = std::min(y0 + 1, sensor_range_m.rows - 1);
      const float a = pixel[0] - static_cast<float>(x0);
      const float b = pixel[1] - static_cast<float>(y0);
      const float r00 = sensor_range_m.at<float>(y0, x0);
      const float r01 = sensor_range_m.at<float>(y0, x1);
      const float r10 = sensor_range_m.at<float>(y1, x0);
      const float r11 = sensor_range_m.at<float>(y1, x1);
      const float low = std::min(std::min(r00, r01), std::min(r10, r11));
      const float high = std::max(std::max(r00, r01), std::max(r10, r11));
      const bool all_hit =
          std::isfinite(r00) && std::isfinite(r01) && std::isfinite(r10) && std::isfinite(r11);
      if (all_hit && high <= kSameSurface * low) {
        const float inverse = (1.0F - b) * ((1.0F - a) / r00 + a / r01) + b * ((1.0F - a) / r10 + a / r11);
        truth.at<float>(y, x) = 1.0F / inverse;
      } else {
        truth.at<float>(y, x) = sensor_range_m.at<float>(b < 0.5F ? y0 : y1, a < 0.5F ? x0 : x1);
      }
    }
  }
  return truth;
}

}  // namespace vcharge
