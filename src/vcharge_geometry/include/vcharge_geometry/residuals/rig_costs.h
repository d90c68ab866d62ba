#pragma once

#include <memory>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_geometry/residuals/pose_block.h"

namespace ceres {
class CostFunction;
}

namespace vcharge {

// Cost functions of a rig's bundle adjustment, all with analytic Jacobians. Pose parameters are PoseBlocks
// with makePoseManifold().

/// Residual of a point that a camera cannot image with the current parameters, per standard deviation: large,
/// and flat, so that a step which brings it about is rejected and a robust loss ignores it.
inline constexpr double kNoImageResidual = 1e3;

/// Reprojection error of a landmark in pixels over `sigma_px` (2 residuals). Blocks: map_from_vehicle (7),
/// vehicle_from_camera (7), intrinsics in the order of the model's parameterNames(), point in the map (3).
/// Intrinsics outside the model's domain make the evaluation fail, and Ceres reject the step.
std::unique_ptr<ceres::CostFunction> makeReprojectionCost(const CameraModel& model,
                                                          const Eigen::Vector2d& pixel, double sigma_px);
/// The same with known intrinsics. Blocks: map_from_vehicle (7), vehicle_from_camera (7), point in the map
/// (3).
std::unique_ptr<ceres::CostFunction> makeReprojectionCost(std::shared_ptr<const CameraModel> model,
                                                          const Eigen::Vector2d& pixel, double sigma_px);

/// Motion between two instants by the odometry against the poses (6 residuals). Blocks: map_from_previous
/// (7), map_from_current (7), odometer (2): true over counted distance, and true over counted turn; both are
/// 1 for a perfect odometer.
///
/// The measured motion is planar; a wrong turn bends its chord by half of the error. `information` is over
/// [t - t_measured, Log(R_measured^T R)] in the previous vehicle's frame: x, y and yaw come from the
/// odometer; z, roll and pitch, which it does not see, from the suspension (weak).
std::unique_ptr<ceres::CostFunction> makeOdometryCost(const RigidTransform& previous_from_current,
                                                      const Eigen::Matrix<double, 6, 6>& information);

/// A pose that is known beforehand (6 residuals): [dt, dphi] from `target_from_source`. Blocks: the pose (7).
std::unique_ptr<ceres::CostFunction> makePosePriorCost(const RigidTransform& target_from_source,
                                                       const Eigen::Matrix<double, 6, 6>& information);

}  // namespace vcharge
