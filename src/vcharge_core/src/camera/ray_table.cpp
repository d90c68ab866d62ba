#include "vcharge_core/camera/ray_table.h"

#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {

RayTable::RayTable(const CameraModel& camera, cv::Size size, double field_of_view_rad, const cv::Mat& mask)
    : size_(size), x_(static_cast<size_t>(size.area())), y_(x_.size()), z_(x_.size()), valid_(x_.size(), 0) {
  check(mask.empty() || (mask.size() == size && mask.type() == CV_8UC1),
        "RayTable: the mask must be CV_8UC1 of the image's size");
  const double min_z = std::cos(0.5 * field_of_view_rad);
  camera.visit([&](const auto& model) {
    Eigen::Vector3d ray;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (!mask.empty() && mask.at<uint8_t>(y, x) == 0) {
          continue;
        }
        if (!model.unproject(Eigen::Vector2d(x, y), &ray) || ray.z() < min_z) {
          continue;
        }
        const size_t i = index(x, y);
        x_[i] = static_cast<float>(ray.x());
        y_[i] = static_cast<float>(ray.y());
        z_[i] = static_cast<float>(ray.z());
        valid_[i] = 1;
      }
    }
  });
}

}  // namespace vcharge
