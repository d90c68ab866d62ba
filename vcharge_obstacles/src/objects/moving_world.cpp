#include "objects/moving_world.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include <Eigen/Geometry>

namespace vcharge {
namespace {

constexpr double kPixel_rad = 0.005;  // in the middle of makeFrontRig()'s image

double hashed(int64_t x, int64_t y, int64_t seed) {
  uint64_t value = static_cast<uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^
                   static_cast<uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^
                   static_cast<uint64_t>(seed) * 0x165667B19E3779F9ULL;
  value ^= value >> 29;
  value *= 0xBF58476D1CE4E5B9ULL;
  value ^= value >> 32;
  return static_cast<double>(value & 0xFFFFU) / 65535.0;
}

/// Value noise, 0 to 1, with cells of one unit.
double noise(double x, double y, int64_t seed) {
  const double column = std::floor(x), row = std::floor(y);
  const double right = x - column, low = y - row;
  const auto at = [&](int dx, int dy) {
    return hashed(static_cast<int64_t>(column) + dx, static_cast<int64_t>(row) + dy, seed);
  };
  return (1.0 - low) * ((1.0 - right) * at(0, 0) + right * at(1, 0)) +
         low * ((1.0 - right) * at(0, 1) + right * at(1, 1));
}

/// Three octaves, so that there is texture at every distance; those finer than `resolution_m` are left out,
/// as a camera averages over its pixels. 0 to 1.
double texture(double x_m, double y_m, int64_t seed, double resolution_m) {
  double sum = 0.5;
  for (const double cells_per_m : {30.0, 9.0, 2.5}) {
    const double amplitude = std::clamp(1.0 / (cells_per_m * resolution_m) - 0.5, 0.0, 1.0) / 3.0;
    sum += amplitude * (noise(x_m * cells_per_m, y_m * cells_per_m, ++seed) - 0.5);
  }
  return sum;
}

}  // namespace

cv::Mat MovingWorld::render(const RigCamera& camera, const RigidTransform& world_from_vehicle,
                            double time_s) const {
  cv::Mat image(camera.image_size_px, CV_8UC1, cv::Scalar(0));
  const RigidTransform world_from_camera = world_from_vehicle * *camera.vehicle_from_camera;
  const Eigen::Vector3d origin = world_from_camera.translation();
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      Eigen::Vector3d ray;
      if (!camera.model.unproject({static_cast<double>(x), static_cast<double>(y)}, &ray)) {
        continue;
      }
      ray = world_from_camera.rotation() * ray.normalized();
      double range_m = INFINITY, brightness = 0.9;
      if (ray.z() < 0.0) {
        range_m = -origin.z() / ray.z();
        const Eigen::Vector3d ground = origin + range_m * ray;
        brightness =
            0.25 + 0.5 * texture(ground.x(), ground.y(), 1, kPixel_rad * range_m * range_m / origin.z());
      }
      for (size_t i = 0; i < cylinders.size(); ++i) {
        const Eigen::Vector2d middle = cylinders[i].positionAt(time_s) - origin.head<2>();
        const Eigen::Vector2d flat = ray.head<2>();
        const double along = flat.dot(middle), squared = flat.squaredNorm();
        const double inside =
            along * along - squared * (middle.squaredNorm() - std::pow(cylinders[i].radius_m, 2));
        const double hit_m = inside > 0.0 ? (along - std::sqrt(inside)) / squared : -1.0;
        const double height_m = origin.z() + hit_m * ray.z();
        if (hit_m > 0.0 && hit_m < range_m && height_m > 0.0 && height_m < cylinders[i].height_m) {
          range_m = hit_m;
          const Eigen::Vector2d side = hit_m * flat - middle;
          const double around_m = std::atan2(side.y(), side.x()) * cylinders[i].radius_m;
          brightness =
              texture(1.5 * around_m, 1.5 * height_m, 100 + 10 * static_cast<int64_t>(i), kPixel_rad * hit_m);
        }
      }
      image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0 * brightness);
    }
  }
  return image;
}

CameraRig makeFrontRig(double height_m) {
  RigCamera camera{"front",     "camera_front_optical",
                   {640, 400},  CameraModel(MeiCamera(1.15, 448.0, 448.0, 320.0, 200.0)),
                   3.2289,      "",
                   {},          std::nullopt,
                   std::nullopt};
  Eigen::Matrix3d axes;  // z ahead, x to the right, y down
  axes << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  camera.vehicle_from_camera = RigidTransform(Eigen::Quaterniond(axes), Eigen::Vector3d(3.5, 0.0, height_m));
  CameraRig rig;
  rig.cameras = {camera};
  return rig;
}

}  // namespace vcharge
