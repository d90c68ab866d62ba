#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "surround_view/surround_renderer.h"
#include "vcharge_core/camera/mei_camera.h"

namespace vcharge {

/// An upright cylinder on the ground.
struct TestPost {
  Eigen::Vector2d position_m;
  double radius_m = 0.1, height_m = 1.2;
  double gray = 250.0;
};

/// Level ground whose gray level is a formula, and posts.
struct TestWorld {
  std::vector<TestPost> posts;
  double mean = 110.0, amplitude = 50.0;
  double rim_loss = 0.0;  ///< part of the brightness that lenses lose at a right angle to their axis

  double grayAt(const Eigen::Vector2d& position_m) const {
    return mean + amplitude * std::sin(3.0 * position_m.x() + 0.4) * std::cos(2.6 * position_m.y() - 0.3);
  }

  double castRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& ray) const {
    double nearest = ray.z() < -1e-6 ? -origin_m.z() / ray.z() : std::numeric_limits<double>::infinity();
    double gray = std::isfinite(nearest) ? grayAt((origin_m + nearest * ray).head<2>()) : 20.0;
    for (const TestPost& post : posts) {
      const Eigen::Vector2d offset = origin_m.head<2>() - post.position_m, flat = ray.head<2>();
      const double a = flat.squaredNorm(), b = offset.dot(flat);
      const double root = b * b - a * (offset.squaredNorm() - post.radius_m * post.radius_m);
      const double range = root > 0.0 ? (-b - std::sqrt(root)) / a : -1.0;
      const double z = origin_m.z() + range * ray.z();
      if (range > 0.0 && range < nearest && z > 0.0 && z < post.height_m) {
        nearest = range;
        gray = post.gray;
      }
    }
    return gray;
  }

  /// The image of a camera, one ray per pixel.
  cv::Mat render(const RigCamera& camera, const RigidTransform& world_from_vehicle, double gain = 1.0) const {
    const RigidTransform world_from_camera = world_from_vehicle * *camera.vehicle_from_camera;
    const Eigen::Matrix3d rotation = world_from_camera.rotationMatrix();
    cv::Mat image = cv::Mat::zeros(camera.image_size_px, CV_8UC1);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        Eigen::Vector3d ray;
        if (camera.model.unproject({column, row}, &ray)) {
          const double angle = std::acos(std::clamp(ray.z(), -1.0, 1.0)) / (0.5 * M_PI);
          image.at<uint8_t>(row, column) =
              cv::saturate_cast<uint8_t>(gain * (1.0 - rim_loss * angle * angle) *
                                         castRay(world_from_camera.translation(), rotation * ray));
        }
      }
    }
    return image;
  }
};

/// Four cameras of 185 degrees on a car, without lens distortion.
inline CameraRig makeTestRig() {
  CameraRig rig;
  const auto add = [&](const std::string& name, const Eigen::Vector3d& position_m, double yaw_rad) {
    constexpr double kDown_rad = 0.6;
    const Eigen::Vector3d z(std::cos(kDown_rad) * std::cos(yaw_rad), std::cos(kDown_rad) * std::sin(yaw_rad),
                            -std::sin(kDown_rad));
    const Eigen::Vector3d x(std::sin(yaw_rad), -std::cos(yaw_rad), 0.0);
    Eigen::Matrix3d rotation;
    rotation << x, z.cross(x), z;
    RigCamera camera{name, "camera_" + name + "_optical", cv::Size(640, 400),
                     MeiCamera(1.15, 360.0, 360.0, 319.5, 199.5)};
    camera.field_of_view_rad = 3.2289;
    camera.vehicle_from_camera = RigidTransform(Eigen::Quaterniond(rotation), position_m);
    rig.cameras.push_back(camera);
  };
  add("front", {3.75, 0.0, 0.67}, 0.0);
  add("left", {1.9, 0.95, 0.95}, M_PI / 2.0);
  add("rear", {-0.95, 0.0, 0.8}, M_PI);
  add("right", {1.9, -0.95, 0.95}, -M_PI / 2.0);
  return rig;
}

/// A frame with all images of a world, at a pose.
inline ImageFrame makeTestFrame(const TestWorld& world, const CameraRig& rig,
                                const RigidTransform& odom_from_vehicle,
                                const std::vector<double>& gains = {1.0, 1.0, 1.0, 1.0}) {
  ImageFrame frame;
  frame.odom_from_vehicle = odom_from_vehicle;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    frame.images.push_back({world.render(rig.cameras[i], odom_from_vehicle, gains[i]), nullptr});
    frame.has_image.push_back(true);
  }
  return frame;
}

}  // namespace vcharge
