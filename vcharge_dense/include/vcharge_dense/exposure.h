#pragma once

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_rates.h"

namespace vcharge {

/// Image point of a pixel of a camera without distortion: (x, y) / (z + xi) of its unit ray.
inline Eigen::Vector2d imagePoint(const MeiCamera& camera, const Eigen::Vector2d& position_px) {
  return {(position_px.x() - camera.u0()) / camera.gamma1(),
          (position_px.y() - camera.v0()) / camera.gamma2()};
}

/// When a camera without distortion exposes a pixel, after the image's or frame's stamp: c0 + m (c1 + c2 r^2
/// + c3 r^4), where r is the length of the image point, and m its coordinate across the lines. The two higher
/// terms are the distortion of the sensor, whose lines are read out.
struct ExposureTimes {
  bool lines_are_columns = false;
  Eigen::Vector4d coefficients_s = Eigen::Vector4d::Zero();

  /// Least squares over the pixels of the working camera; the rig's camera tells the times of the sensor's.
  static ExposureTimes of(const RigCamera& camera, const WorkingCamera& working);

  double at(const Eigen::Vector2d& image_point) const {
    const double squared = image_point.squaredNorm();
    const Eigen::Vector4d& c = coefficients_s;
    return c[0] + image_point[lines_are_columns ? 0 : 1] * (c[1] + squared * (c[2] + squared * c[3]));
  }
};

/// Motion of a camera while the lines of an image are exposed, to first order: of 25 ms at 4 m/s and 0.5
/// rad/s the second order moves points by 0.2 mm and directions by 0.001 degrees.
struct Exposure {
  ExposureTimes times;
  // Rates of the camera, in its frame at the frame's stamp.
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_rate_rad_per_s = Eigen::Vector3d::Zero();

  static Exposure of(const ExposureTimes& times, const RigidTransform& vehicle_from_camera,
                     const ImageMotion& motion);

  /// Whether pixels are seen from elsewhere than from where the camera was at the stamp.
  bool moves() const {
    return !times.coefficients_s.isZero(0.0) &&
           !(velocity_m_per_s.isZero(0.0) && turn_rate_rad_per_s.isZero(0.0));
  }
};

}  // namespace vcharge
