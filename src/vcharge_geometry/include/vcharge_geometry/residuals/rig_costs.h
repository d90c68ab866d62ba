#pragma once

#include <memory>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_geometry/residuals/pose_block.h"

namespace ceres {
class CostFunction;
}

namespace vcharge {

// Cost functions for the bundle adjustment of a rig, with analytic Jacobians. Poses are PoseBlocks with
// makePoseManifold().

/// Residual, in standard deviations, of a point that a camera cannot image with the current parameters. Large
/// and constant, so that a step that causes it is rejected and a robust loss ignores it.
inline constexpr double kNoImageResidual = 1e3;

/// Reprojection error of a landmark in pixels divided by `sigma_px` (2 residuals). Blocks: map_from_vehicle
/// (7), vehicle_from_camera (7), intrinsics in the order of parameterNames(), point in the map (3). The
/// evaluation fails, and Ceres rejects the step, if the intrinsics are outside the model's domain.
std::unique_ptr<ceres::CostFunction> makeReprojectionCost(const CameraModel& model,
                                                          const Eigen::Vector2d& pixel, double sigma_px);
/// The same with known intrinsics. Blocks: map_from_vehicle (7), vehicle_from_camera (7), point in the map
/// (3).
std::unique_ptr<ceres::CostFunction> makeReprojectionCost(std::shared_ptr<const CameraModel> model,
                                                          const Eigen::Vector2d& pixel, double sigma_px);

/// Error of the motion between two poses relative to the odometry (6 residuals). Blocks: map_from_previous
/// (7), map_from_current (7), odometer scales (2): true over counted distance, and true over counted turn.
/// The measured motion is planar; a wrong turn rotates its chord by half of the error. `information` is over
/// [t - t_measured, Log(R_measured^T R)] in the previous vehicle frame: x, y and yaw come from the odometer;
/// z, roll and pitch are only weakly constrained, by the suspension.
std::unique_ptr<ceres::CostFunction> makeOdometryCost(const RigidTransform& previous_from_current,
                                                      const Eigen::Matrix<double, 6, 6>& information);

}  // namespace vcharge
