#include "points/panorama.h"

#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kHalfWidth_rad = 1.68;
constexpr double kTopSlope = 0.6, kBottomSlope = -0.9;

/// Angle between the rays of two neighbouring pixels in the middle of the view.
double pixelAngle(const RigCamera& camera) {
  constexpr double kAngle_rad = 0.01;
  Eigen::Vector2d left, right;
  check(camera.model.project(Eigen::Vector3d(-std::sin(kAngle_rad), 0.0, std::cos(kAngle_rad)), &left) &&
            camera.model.project(Eigen::Vector3d(std::sin(kAngle_rad), 0.0, std::cos(kAngle_rad)), &right),
        "Panorama: the camera does not see its axis");
  return 2.0 * kAngle_rad / (right - left).norm();
}

}  // namespace

Panorama::Panorama(const RigCamera& camera) : pixel_rad_(pixelAngle(camera)), top_slope_(kTopSlope) {
  const Eigen::Quaterniond camera_from_vehicle = camera.vehicle_from_camera->rotation().conjugate();
  const Eigen::Vector3d axis = camera.vehicle_from_camera->rotation() * Eigen::Vector3d::UnitZ();
  middle_rad_ = std::atan2(axis.y(), axis.x());
  const int width = 2 * static_cast<int>(kHalfWidth_rad / pixel_rad_) + 1, middle = width / 2;
  const int height = static_cast<int>((kTopSlope - kBottomSlope) / pixel_rad_) + 1;
  const double min_cosine = std::cos(0.5 * camera.field_of_view_rad);
  cv::Mat map(height, width, CV_32FC2, cv::Scalar::all(-1.0));
  valid_mask_ = cv::Mat::zeros(height, width, CV_8UC1);
  const cv::Rect image(cv::Point(), camera.image_size_px);
  camera.model.visit([&](const auto& model) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double azimuth_rad = middle_rad_ + (middle - x) * pixel_rad_;
        const Eigen::Vector3d direction =
            camera_from_vehicle *
            Eigen::Vector3d(std::cos(azimuth_rad), std::sin(azimuth_rad), top_slope_ - y * pixel_rad_)
                .normalized();
        Eigen::Vector2d pixel;
        if (direction.z() < min_cosine || !model.project(direction, &pixel)) {
          continue;
        }
        const cv::Point nearest(cvRound(pixel.x()), cvRound(pixel.y()));
        if (image.contains(nearest) && (camera.mask.empty() || camera.mask.at<uint8_t>(nearest) != 0)) {
          map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
          valid_mask_.at<uint8_t>(y, x) = 255;
        }
      }
    }
  });
  cv::convertMaps(map, cv::Mat(), pixels_, fractions_, CV_16SC2);
}

cv::Mat Panorama::render(const cv::Mat& image) const {
  cv::Mat panorama;
  cv::remap(image, panorama, pixels_, fractions_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  return panorama;
}

double Panorama::columnOf(double azimuth_rad) const {
  const int middle = valid_mask_.cols / 2;
  return middle - std::remainder(azimuth_rad - middle_rad_, 2.0 * M_PI) / pixel_rad_;
}

}  // namespace vcharge
