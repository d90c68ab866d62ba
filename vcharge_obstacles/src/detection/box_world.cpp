#include "detection/box_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "vcharge_core/camera/ray_table.h"
#include "vcharge_core/camera/working_camera.h"

namespace vcharge {
namespace {

constexpr double kMaxRange_m = 30.0;
constexpr double kSmallestSigma_m = 0.005;

/// Approximately normal number of variance one: a sum of four uniform numbers, which all standard libraries
/// compute identically.
double normalNumber(std::mt19937* generator) {
  double sum = -2.0;
  for (int i = 0; i < 4; ++i) {
    sum += static_cast<double>((*generator)()) / 4294967296.0;
  }
  return std::sqrt(3.0) * sum;
}

RigCamera makeCamera(const std::string& name, const Eigen::Vector3d& position, double yaw_rad,
                     double down_rad) {
  const Eigen::Vector3d z(std::cos(down_rad) * std::cos(yaw_rad), std::cos(down_rad) * std::sin(yaw_rad),
                          -std::sin(down_rad));
  const Eigen::Vector3d x(std::sin(yaw_rad), -std::cos(yaw_rad), 0.0);
  Eigen::Matrix3d rotation;
  rotation << x, z.cross(x), z;
  RigCamera camera{name, "camera_" + name + "_optical", cv::Size(256, 160),
                   MeiCamera(1.15, 179.0, 179.0, 127.5, 79.5)};
  camera.field_of_view_rad = 3.2289;
  camera.vehicle_from_camera = RigidTransform(Eigen::Quaterniond(rotation), position);
  return camera;
}

}  // namespace

double BoxWorld::castRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  double nearest = std::numeric_limits<double>::infinity();
  if (direction.z() < 0.0) {
    nearest = -origin.z() / direction.z();
  }
  for (const WorldBox& box : boxes) {
    const Eigen::Array3d a = (box.min_m - origin).array() / direction.array();
    const Eigen::Array3d b = (box.max_m - origin).array() / direction.array();
    const double enter = a.min(b).maxCoeff();
    const double leave = a.max(b).minCoeff();
    if (enter <= leave && enter > 0.0) {
      nearest = std::min(nearest, enter);
    }
  }
  return nearest;
}

CameraRig makeBoxWorldRig() {
  CameraRig rig;
  rig.cameras = {makeCamera("front", {3.6, 0.0, 0.6}, 0.0, 0.35),
                 makeCamera("left", {1.9, 0.98, 0.9}, 0.5 * M_PI, 0.84),
                 makeCamera("right", {1.9, -0.98, 0.9}, -0.5 * M_PI, 0.84)};
  return rig;
}

RangeMap measureBoxWorld(const BoxWorld& world, const RigCamera& camera,
                         const RigidTransform& world_from_vehicle, Timestamp stamp,
                         const BoxWorldNoise& noise) {
  WorkingCameraOptions options;
  options.image_scale = 1.0;
  const WorkingCamera working(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask,
                              options);
  const RayTable rays(working.model(), working.size(), 2.0 * M_PI, working.validMask());
  const RigidTransform world_from_camera = world_from_vehicle * *camera.vehicle_from_camera;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  RangeMap map{stamp,
               camera.name,
               camera.frame_id,
               working.model(),
               cv::Mat(working.size(), CV_32FC1, cv::Scalar(nan)),
               cv::Mat(working.size(), CV_32FC1, cv::Scalar(nan)),
               cv::Mat(working.size(), CV_32FC1, cv::Scalar(0.0))};
  std::mt19937 generator(noise.seed);
  for (int y = 0; y < working.size().height; ++y) {
    for (int x = 0; x < working.size().width; ++x) {
      const bool unknown = generator() < noise.unknown_fraction * 4294967296.0;
      const double error = normalNumber(&generator);
      if (!rays.valid(x, y) || unknown) {
        continue;
      }
      const Eigen::Vector3d direction = world_from_camera.rotation() * rays.ray(x, y).cast<double>();
      const double range_m = world.castRay(world_from_camera.translation(), direction);
      if (range_m > kMaxRange_m) {
        continue;
      }
      map.range_m.at<float>(y, x) = static_cast<float>(range_m * (1.0 + noise.relative_sigma * error));
      map.standard_deviation_m.at<float>(y, x) =
          static_cast<float>(std::max(kSmallestSigma_m, noise.relative_sigma * range_m));
      map.confidence.at<float>(y, x) = 0.95F;
    }
  }
  return map;
}

}  // namespace vcharge
