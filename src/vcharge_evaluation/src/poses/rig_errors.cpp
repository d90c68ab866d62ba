#include "vcharge_evaluation/rig_errors.h"

#include <cmath>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

const RigidTransform& extrinsicsOf(const CameraRig& rig, const std::string& name, const char* which) {
  const int index = rig.findCamera(name);
  if (index < 0) {
    throw InputError(std::string(which) + ": expected a camera '" + name + "'");
  }
  if (!rig.cameras[index].vehicle_from_camera) {
    throw InputError(std::string(which) + ": cameras." + name + ": expected vehicle_from_camera");
  }
  return *rig.cameras[index].vehicle_from_camera;
}

}  // namespace

RigErrors evaluateRig(const CameraRig& estimate, const CameraRig& truth) {
  RigErrors result;
  double product = 0.0, square = 0.0;
  for (const RigCamera& camera : truth.cameras) {
    const Eigen::Vector3d& estimated = extrinsicsOf(estimate, camera.name, "estimate").translation();
    product += estimated.dot(extrinsicsOf(truth, camera.name, "truth").translation());
    square += estimated.squaredNorm();
  }
  if (square > 0.0) {
    result.scale = product / square;
  }
  const auto errorsAt = [&](double scale, bool is_scale_known) {
    std::vector<CameraErrors> errors;
    for (const RigCamera& camera : truth.cameras) {
      const RigidTransform& estimated = extrinsicsOf(estimate, camera.name, "estimate");
      CameraErrors of_camera;
      of_camera.name = camera.name;
      const RigidTransform scaled(estimated.rotation(), scale * estimated.translation());
      of_camera.error = stepBetween(scaled, *camera.vehicle_from_camera);
      const size_t index = estimate.cameraIndex(camera.name);
      if (const auto covariance =
              is_scale_known ? estimate.cameras[index].covariance : estimate.covarianceWithScale(index)) {
        of_camera.normalized = of_camera.error.cwiseQuotient(covariance->diagonal().cwiseSqrt());
      }
      errors.push_back(of_camera);
    }
    return errors;
  };
  result.as_is = errorsAt(1.0, false);
  result.without_scale = errorsAt(result.scale, true);
  return result;
}

}  // namespace vcharge
