#include "rig_adjustment.h"

#include <cmath>
#include <memory>

#include "vcharge_core/error.h"

namespace vcharge {
namespace {

constexpr double kCommonSigma_m = 1e-4;
constexpr double kCommonSigma_rad = 1e-4;

BundleProblem makeRigProblem(const BundleAdjustmentOptions& options, const MappingData& data) {
  BundleProblem problem = makeBundleProblem(options, data);
  for (const RigCamera& camera : data.rig->cameras) {
    problem.vehicle_from_camera.push_back(*camera.vehicle_from_camera);
  }
  problem.common_information.diagonal().segment<3>(2) =
      Eigen::Vector3d(kCommonSigma_m, kCommonSigma_rad, kCommonSigma_rad).cwiseAbs2().cwiseInverse();
  return problem;
}

}  // namespace

BundleAdjustmentSummary adjustRig(const BundleAdjustmentOptions& options, MappingData* data) {
  options.validate();
  check(!data->keyframes.empty(), "adjustRig: expected keyframes");
  BundleProblem problem = makeRigProblem(options, *data);
  const BundleSolution solved = solveBundle(options.max_iterations, options.cost_tolerance, &problem);
  writeBack(problem, data);
  auto rig = std::make_shared<CameraRig>(*data->rig);
  for (size_t i = 0; i < rig->cameras.size(); ++i) {
    rig->cameras[i].vehicle_from_camera = problem.vehicle_from_camera[i];
  }
  data->rig = rig;
  BundleAdjustmentSummary summary = removeOutliers(options, data);
  summary.converged = solved.converged;
  summary.num_iterations = solved.num_iterations;
  return summary;
}

RigUncertainty rigUncertainty(const BundleAdjustmentOptions& options, double segment_m,
                              const MappingData& data) {
  RigUncertainty result;
  const BundleCovariance tail = bundleCovariance(makeRigProblem(options, data));
  if (!tail.is_valid) {
    return result;
  }
  const Eigen::Index size = tail.covariance.rows() - 2;
  result.is_valid = true;
  result.covariance = tail.covariance.bottomRightCorner(size, size);
  result.jackknife.setZero(size, size);
  Eigen::VectorXd segment = Eigen::VectorXd::Zero(size);
  int num_segments = 0;
  double begin_m = 0.0;
  const auto add = [&] {
    result.jackknife += segment * segment.transpose();
    segment.setZero();
    ++num_segments;
  };
  for (size_t i = 0; i < data.keyframes.size(); ++i) {
    if (data.keyframes[i].travelled_m - begin_m > segment_m) {
      add();
      begin_m = data.keyframes[i].travelled_m;
    }
    segment += tail.influence.col(static_cast<Eigen::Index>(i)).tail(size);
  }
  add();
  if (num_segments > 1) {
    result.jackknife *= num_segments / (num_segments - 1.0);
  }
  return result;
}

}  // namespace vcharge
