#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A flat surface: the points p with normal . (p - centre) = 0 and |p - centre| within `half_size_m` per
/// axis.
struct Patch {
  Eigen::Vector3d centre;
  Eigen::Vector3d normal;
  Eigen::Vector3d half_size_m = Eigen::Vector3d::Constant(1e6);
  double contrast = 1.0;  ///< contrast of the texture; 0: one gray level
};

/// Patches with a band-limited texture, a function of the point in space, rendered by exact projection.
class AnalyticScene {
 public:
  AnalyticScene(std::vector<Patch> patches, uint32_t seed);

  /// Gray image (CV_8UC1) of a camera, with Gaussian noise of the given standard deviation before rounding.
  /// Waves of the texture that are shorter than a pixel fade out.
  cv::Mat render(const MeiCamera& camera, cv::Size size, const RigidTransform& world_from_camera,
                 double noise_gray_levels = 0.0, uint32_t noise_seed = 1) const;
  /// Pose of the camera when it exposed a row of the image.
  using PoseOfRow = std::function<RigidTransform(int row)>;
  cv::Mat render(const MeiCamera& camera, cv::Size size, const PoseOfRow& world_from_camera,
                 double noise_gray_levels = 0.0, uint32_t noise_seed = 1) const;
  /// Distance along each pixel's ray (CV_64FC1), NaN if it meets no surface.
  cv::Mat range(const MeiCamera& camera, cv::Size size, const RigidTransform& world_from_camera) const;
  cv::Mat range(const MeiCamera& camera, cv::Size size, const PoseOfRow& world_from_camera) const;

 private:
  struct Wave {
    Eigen::Vector3d frequency;  // radians per metre
    double phase;
    double amplitude;
  };
  struct Hit {
    double range_m;
    double contrast;
    double cos_incidence;
  };
  Hit intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  std::vector<Patch> patches_;
  std::vector<Wave> waves_;
};

/// A standard normal number; identical for every standard library.
double normalNumber(std::mt19937* generator);

}  // namespace vcharge
