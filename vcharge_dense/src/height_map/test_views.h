#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge::testing {

/// A range map of a fisheye camera with one confident, accurate range in all pixels.
inline RangeMap blankView(cv::Size size) {
  return {Timestamp::fromNanoseconds(1),
          "left",
          "camera_left_optical",
          MeiCamera(1.1, 0.5 * size.width, 0.5 * size.width, 0.5 * (size.width - 1), 0.5 * (size.height - 1)),
          cv::Mat(size, CV_32FC1, cv::Scalar(3.0)),
          cv::Mat(size, CV_32FC1, cv::Scalar(0.02)),
          cv::Mat(size, CV_32FC1, cv::Scalar(1.0))};
}

inline Eigen::Vector3d rayOf(const RangeMap& map, int x, int y) {
  Eigen::Vector3d ray(0, 0, 1);
  map.camera.unproject(Eigen::Vector2d(x, y), &ray);
  return ray;
}

/// Pose of a camera that faces an azimuth and is tilted downwards.
inline RigidTransform cameraPose(const Eigen::Vector3d& position_m, double azimuth_rad, double down_rad) {
  const Eigen::Quaterniond vehicle_from_optical(0.5, -0.5, 0.5, -0.5);  // z forward, x right, y down
  return RigidTransform(rotationFromYawPitchRoll(azimuth_rad, down_rad, 0.0) * vehicle_from_optical,
                        position_m);
}

/// A box on level ground at z = 0.
struct BoxWorld {
  Eigen::Vector3d low{2.0, -0.5, 0.0}, high{3.0, 0.5, 0.4};

  double heightAt(double x, double y) const {
    return x >= low.x() && x <= high.x() && y >= low.y() && y <= high.y() ? high.z() : 0.0;
  }
  /// Distance along a ray to the first surface, NaN where there is none.
  double castRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    double nearest = direction.z() < -1e-9 ? -origin.z() / direction.z() : std::nan("");
    double enter = 0.0, leave = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - origin[axis]) / direction[axis],
                   b = (high[axis] - origin[axis]) / direction[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    if (enter < leave && enter > 0.0 && !(nearest < enter)) {
      nearest = enter;
    }
    return nearest;
  }
};

inline RangeMap renderView(const BoxWorld& world, const RigidTransform& world_from_camera, cv::Size size) {
  RangeMap map = blankView(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector3d direction = world_from_camera.rotation() * rayOf(map, x, y);
      map.range_m.at<float>(y, x) =
          static_cast<float>(world.castRay(world_from_camera.translation(), direction));
    }
  }
  return map;
}

}  // namespace vcharge::testing
