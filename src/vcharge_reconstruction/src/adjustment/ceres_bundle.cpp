#include "adjustment/ceres_bundle.h"

#include <memory>
#include <vector>

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <Eigen/Cholesky>

#include "vcharge_geometry/residuals/pose_block.h"
#include "vcharge_geometry/residuals/rig_costs.h"

namespace vcharge::testing {

void solveWithCeres(int max_iterations, double cost_tolerance, BundleProblem* bundle) {
  std::vector<PoseBlock> poses, extrinsics;
  for (const RigidTransform& pose : bundle->map_from_vehicle) {
    poses.push_back(toPoseBlock(pose));
  }
  std::vector<std::shared_ptr<const CameraModel>> models;
  const bool known_cameras = bundle->vehicle_from_camera.empty();
  for (size_t i = 0; i < bundle->rig->cameras.size(); ++i) {
    const RigCamera& camera = bundle->rig->cameras[i];
    extrinsics.push_back(
        toPoseBlock(known_cameras ? *camera.vehicle_from_camera : bundle->vehicle_from_camera[i]));
    models.emplace_back(bundle->rig, &camera.model);
  }
  ceres::Problem problem;
  auto* manifold = makePoseManifold().release();  // the problem's from the first use on
  for (PoseBlock& pose : poses) {
    problem.AddParameterBlock(pose.data(), 7, manifold);
  }
  for (PoseBlock& pose : extrinsics) {
    problem.AddParameterBlock(pose.data(), 7, manifold);
    if (known_cameras) {
      problem.SetParameterBlockConstant(pose.data());
    }
  }
  problem.SetParameterBlockConstant(poses.front().data());
  auto* loss = new ceres::CauchyLoss(bundle->loss_sigmas);
  for (size_t point = 0; point < bundle->points_in_map.size(); ++point) {
    for (size_t i = bundle->first_observation[point]; i < bundle->first_observation[point + 1]; ++i) {
      const BundleObservation& observation = bundle->observations[i];
      problem.AddResidualBlock(
          makeReprojectionCost(models[observation.camera], observation.position_px, observation.sigma_px)
              .release(),
          loss, poses[observation.pose].data(), extrinsics[observation.camera].data(),
          bundle->points_in_map[point].data());
    }
    if (!bundle->point_information.empty()) {
      const Eigen::Matrix3d root = bundle->point_information[point].llt().matrixU();
      problem.AddResidualBlock(new ceres::NormalPrior(root, bundle->points_in_map[point]), nullptr,
                               bundle->points_in_map[point].data());
    }
  }
  for (const OdometerFactor& factor : bundle->odometer_factors) {
    problem.AddResidualBlock(makeOdometryCost(factor.previous_from_current, factor.information).release(),
                             nullptr, poses[factor.pose - 1].data(), poses[factor.pose].data(),
                             bundle->odometer.data());
  }
  const Eigen::Vector2d weights = bundle->odometer_sigmas.cwiseInverse();
  problem.AddResidualBlock(new ceres::NormalPrior(weights.asDiagonal(), Eigen::Vector2d::Ones()), nullptr,
                           bundle->odometer.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = cost_tolerance;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (size_t i = 0; i < poses.size(); ++i) {
    bundle->map_from_vehicle[i] = fromPoseBlock(poses[i]);
  }
  for (size_t i = 0; i < bundle->vehicle_from_camera.size(); ++i) {
    bundle->vehicle_from_camera[i] = fromPoseBlock(extrinsics[i]);
  }
}

}  // namespace vcharge::testing
