#include "rig_adjustment.h"

#include <cmath>
#include <memory>

#include "ground.h"
#include "vcharge_core/error.h"

namespace vcharge {
namespace {

/// The problem of mapping, with the ground's observations put to their points.
BundleProblem makeRigProblem(const RigCalibratorOptions& options, const MappingData& data) {
  const BundleProblem mapping = makeBundleProblem(options.bundle, data);
  BundleProblem problem = mapping;
  for (const RigCamera& camera : data.rig->cameras) {
    problem.vehicle_from_camera.push_back(*camera.vehicle_from_camera);
  }
  problem.observations.clear();
  const std::vector<GroundPoint> ground = findGroundPoints(data, options.max_ground_distance_m);
  auto next_ground = ground.begin();
  size_t point = 0;
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    if (!data.tracks[t].position_m) {
      continue;
    }
    problem.first_observation[point] = problem.observations.size();
    const bool is_ground = next_ground != ground.end() && next_ground->track == static_cast<int32_t>(t);
    for (size_t i = mapping.first_observation[point]; i < mapping.first_observation[point + 1]; ++i) {
      if (is_ground && mapping.observations[i].pose == next_ground->keyframe &&
          (i == mapping.first_observation[point] ||
           mapping.observations[i - 1].pose != next_ground->keyframe)) {
        problem.observations.push_back(
            {next_ground->keyframe, kGroundCamera, Eigen::Vector2d::Zero(), options.ground_sigma_m});
      }
      problem.observations.push_back(mapping.observations[i]);
    }
    next_ground += is_ground ? 1 : 0;
    ++point;
  }
  problem.first_observation[point] = problem.observations.size();
  return problem;
}

}  // namespace

BundleAdjustmentSummary adjustRig(const RigCalibratorOptions& options, MappingData* data) {
  check(!data->keyframes.empty(), "adjustRig: expected keyframes");
  BundleProblem problem = makeRigProblem(options, *data);
  const BundleSolution solved = solveBundle(options.bundle.max_iterations, options.bundle.cost_tolerance, &problem);
  writeBack(problem, data);
  auto rig = std::make_shared<CameraRig>(*data->rig);
  for (size_t i = 0; i < rig->cameras.size(); ++i) {
    rig->cameras[i].vehicle_from_camera = problem.vehicle_from_camera[i];
  }
  data->rig = rig;
  BundleAdjustmentSummary summary = removeOutliers(options.bundle, data);
  summary.converged = solved.converged;
  summary.num_iterations = solved.num_iterations;
  return summary;
}

RigUncertainty rigUncertainty(const RigCalibratorOptions& options, const MappingData& data) {
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
    if (data.keyframes[i].travelled_m - begin_m > options.segment_m) {
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
