#include "vcharge_calibration/report/rig_comparison.h"

#include <Eigen/Cholesky>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

/// 99.7 % quantile of the chi-square distribution with 6 degrees of freedom.
constexpr double kSignificantChiSquare = 19.8;

const RigidTransform& extrinsicsOf(const RigCamera& camera, const char* which) {
  if (!camera.vehicle_from_camera) {
    throw InputError(std::string(which) + " rig: cameras." + camera.name + ": expected vehicle_from_camera");
  }
  return *camera.vehicle_from_camera;
}

}  // namespace

RigComparison compareRigs(const CameraRig& first, const CameraRig& second) {
  RigComparison result;
  for (const RigCamera& camera : first.cameras) {
    const int index = second.findCamera(camera.name);
    if (index < 0) {
      result.only_first.push_back(camera.name);
      continue;
    }
    const RigCamera& other = second.cameras[index];
    CameraDifference of_camera;
    of_camera.name = camera.name;
    of_camera.difference = stepBetween(extrinsicsOf(camera, "first"), extrinsicsOf(other, "second"));
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    for (const auto& of_rig : {camera.covariance, other.covariance}) {
      if (of_rig) {
        covariance += *of_rig;
        of_camera.has_sigma = true;
      }
    }
    if (of_camera.has_sigma) {
      of_camera.sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
      of_camera.chi_square = of_camera.difference.dot(covariance.ldlt().solve(of_camera.difference));
      of_camera.is_significant = of_camera.chi_square > kSignificantChiSquare;
    }
    result.cameras.push_back(of_camera);
  }
  for (const RigCamera& camera : second.cameras) {
    if (first.findCamera(camera.name) < 0) {
      result.only_second.push_back(camera.name);
    }
  }
  return result;
}

}  // namespace vcharge
