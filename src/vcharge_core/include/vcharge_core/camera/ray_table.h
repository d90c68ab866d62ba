#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Precomputed unit rays of all pixels of a camera, as a structure of arrays in row-major order. Immutable.
class RayTable {
 public:
  /// A pixel is valid if the model has a ray, the ray lies within field_of_view_rad / 2 of the optical axis,
  /// and the mask (empty, or CV_8UC1 of `size`) is not 0. Throws std::logic_error for a mask of another size.
  RayTable(const CameraModel& camera, cv::Size size, double field_of_view_rad,
           const cv::Mat& mask = cv::Mat());

  cv::Size size() const { return size_; }
  bool valid(int x, int y) const { return valid_[index(x, y)] != 0; }
  /// Zero for pixels that are not valid.
  Eigen::Vector3f ray(int x, int y) const {
    const size_t i = index(x, y);
    return Eigen::Vector3f(x_[i], y_[i], z_[i]);
  }
  const std::vector<float>& x() const { return x_; }
  const std::vector<float>& y() const { return y_; }
  const std::vector<float>& z() const { return z_; }
  const std::vector<uint8_t>& valid() const { return valid_; }

 private:
  size_t index(int x, int y) const { return static_cast<size_t>(y) * size_.width + x; }
  cv::Size size_;
  std::vector<float> x_, y_, z_;
  std::vector<uint8_t> valid_;
};

}  // namespace vcharge
