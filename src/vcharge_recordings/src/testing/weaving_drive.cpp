#include "testing/weaving_drive.h"

#include <algorithm>
#include <cmath>

namespace vcharge::weaving_drive {
namespace {

constexpr double kSpeed_m_per_s = 1.5;

double yawAt(double time_s) {
  return 0.9 * std::sin(0.55 * time_s) + 0.25 * std::sin(1.7 * time_s);
}

/// Brightness of a textured wall all around, 15 m away, and of a textured ground.
double brightness(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  const Eigen::Vector2d from = origin.head<2>() - Eigen::Vector2d(10.0, 0.0), along = ray.head<2>();
  const double a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - 15.0 * 15.0;
  double u = 0.0, v = 0.0, length = 1e9;
  if (a > 1e-9) {
    length = (-b + std::sqrt(std::max(0.0, b * b - a * c))) / a;
    const Eigen::Vector3d hit = origin + length * ray;
    u = 15.0 * std::atan2(hit.y(), hit.x() - 10.0);
    v = hit.z();
  }
  if (ray.z() < 0.0 && -origin.z() / ray.z() < length) {
    const Eigen::Vector3d hit = origin - origin.z() / ray.z() * ray;
    u = 2.0 * hit.x();
    v = 2.0 * hit.y() + 31.0;
  }
  return 115.0 + 25.0 * std::sin(1.9 * u + 1.3 * std::sin(0.8 * v)) +
         25.0 * std::sin(2.3 * v + 1.1 * std::sin(1.1 * u)) + 20.0 * std::sin(0.7 * u + 0.9 * v) +
         20.0 * std::sin(4.1 * u - 3.3 * v + std::sin(u));
}

cv::Mat render(const RigCamera& camera, const RigidTransform& world_from_vehicle) {
  cv::Mat image(camera.image_size_px, CV_8UC1, cv::Scalar(0));
  const RigidTransform world_from_camera = world_from_vehicle * *camera.vehicle_from_camera;
  camera.model.visit([&](const auto& model) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        Eigen::Vector3d ray;
        if (model.unproject(Eigen::Vector2d(x, y), &ray)) {
          image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(
              brightness(world_from_camera.translation(), world_from_camera.rotation() * ray));
        }
      }
    }
  });
  cv::Mat noise(image.size(), CV_8SC1);
  cv::RNG random(static_cast<uint64_t>(1e6 * world_from_camera.translation().x()) + 7);
  random.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
  cv::add(image, noise, image, cv::noArray(), CV_8U);
  return image;
}

}  // namespace

RigidTransform worldFromVehicle(double time_s) {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  constexpr double kStep_s = 0.01;
  for (double t = 0.0; t + 0.5 * kStep_s < time_s; t += kStep_s) {
    const double yaw = yawAt(t + 0.5 * kStep_s);
    position += kStep_s * kSpeed_m_per_s * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
  }
  return RigidTransform::planar(position.x(), position.y(), yawAt(time_s));
}

CameraRig twoCameras() {
  CameraRig rig;
  for (const double yaw : {1.2, -1.2}) {
    RigCamera camera{yaw > 0.0 ? "left" : "right",
                     yaw > 0.0 ? "left_optical" : "right_optical",
                     cv::Size(320, 200),
                     MeiCamera({0.9, 180.0, 180.0, 159.5, 99.5, 0.0, 0.0, 0.0, 0.0}),
                     2.6,
                     "",
                     cv::Mat(),
                     std::nullopt,
                     std::nullopt};
    Eigen::Matrix3d vehicle_from_forward;
    vehicle_from_forward << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.vehicle_from_camera = RigidTransform(
        Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::Quaterniond(vehicle_from_forward),
        Eigen::Vector3d(1.0, yaw > 0.0 ? 0.8 : -0.8, 1.0));
    rig.cameras.push_back(camera);
  }
  return rig;
}

std::vector<std::vector<cv::Mat>> renderImages() {
  std::vector<std::vector<cv::Mat>> images;
  for (const RigCamera& camera : twoCameras().cameras) {
    images.emplace_back();
    for (int frame = 0; frame < kFrames; ++frame) {
      images.back().push_back(render(camera, worldFromVehicle(kPeriod_s * frame)));
    }
  }
  return images;
}

}  // namespace vcharge::weaving_drive
