#include "rig/rig_adjustment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "rig/ground.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Factor on the odometer's standard deviation if the wheels slipped.
constexpr double kSlipFactor = 20.0;
constexpr double kSlipSigmas = 5.0;
/// Larger turns between keyframes tilt the body.
constexpr double kMinTurn_rad = 0.01;
// Minimum standard deviations of an odometer.
constexpr double kMinOdometrySigma_m = 0.0005;
constexpr double kMinOdometrySigma_rad = 0.0002;
constexpr double kMinHeightSigma_m = 0.001;
constexpr double kMinTiltSigma_rad = 0.0005;
constexpr size_t kMinMotions = 10;

/// Weights of the keyframes for the cameras' tilt. The body tilts outwards in turns, which cancels if left
/// and right have the same sum of weights: the side with more turns gets less weight.
std::vector<double> balanceTurns(const ReconstructionData& data) {
  std::vector<double> turns_rad(data.keyframes.size(), 0.0);
  double left_rad = 0.0, right_rad = 0.0;
  for (size_t i = 1; i < data.keyframes.size(); ++i) {
    turns_rad[i] = yawOfRotation(data.keyframes[i - 1].odom_from_vehicle.rotation().conjugate() *
                                 data.keyframes[i].odom_from_vehicle.rotation());
    (turns_rad[i] > 0.0 ? left_rad : right_rad) += std::abs(turns_rad[i]);
  }
  const double less_rad = std::max(std::min(left_rad, right_rad), 1e-6);
  std::vector<double> weights(data.keyframes.size(), 1.0);
  for (size_t i = 0; i < weights.size(); ++i) {
    if (std::abs(turns_rad[i]) > kMinTurn_rad) {
      weights[i] = less_rad / std::max(less_rad, turns_rad[i] > 0.0 ? left_rad : right_rad);
    }
  }
  return weights;
}

/// Landmarks on the ground; planar motion does not determine the cameras' height, and barely their tilt.
std::vector<GroundObservation> makeGroundObservations(const RigAdjustmentOptions& options,
                                                      const std::vector<GroundPoint>& ground_points,
                                                      const std::vector<double>& weights,
                                                      const ReconstructionData& data) {
  std::vector<int32_t> point_of_track(data.tracks.size(), 0);
  int32_t num_points = 0;
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    point_of_track[t] = num_points;
    num_points += data.tracks[t].position_m ? 1 : 0;
  }
  std::vector<GroundObservation> observations;
  for (const GroundPoint& ground : ground_points) {
    observations.push_back({point_of_track[ground.track], ground.keyframe,
                            options.ground_sigma_m / std::sqrt(weights[ground.keyframe])});
  }
  return observations;
}

/// Information on the height of the cameras as one rigid body: the mean of their heights, less what tilt
/// about the vehicle's origin adds.
Eigen::MatrixXd commonHeightInformation(const std::vector<RigidTransform>& vehicle_from_camera,
                                        double sigma_m) {
  Eigen::RowVectorXd height(static_cast<Eigen::Index>(6 * vehicle_from_camera.size()));
  for (size_t i = 0; i < vehicle_from_camera.size(); ++i) {
    height.segment<6>(static_cast<Eigen::Index>(6 * i)) << 0.0, 0.0, 1.0,
        crossMatrix(vehicle_from_camera[i].translation()).row(2);
  }
  height /= static_cast<double>(vehicle_from_camera.size()) * sigma_m;
  return height.transpose() * height;
}

/// Builds the bundle adjustment with unknown extrinsics, ground observations and priors.
BundleProblem makeRigProblem(const RigAdjustmentOptions& options, const RigPriors& priors,
                             const ReconstructionData& data) {
  const OdometryNoise& odometry = priors.odometry;
  BundleProblem problem = makeBundleProblem(options.bundle, data);
  const std::vector<double> weights = balanceTurns(data);
  for (OdometerFactor& factor : problem.odometer_factors) {
    if (odometry.isKnown()) {
      factor.information = odometry.sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
      factor.information /= odometry.has_slipped[factor.pose] ? kSlipFactor * kSlipFactor : 1.0;
    }
    factor.information.block<2, 2>(3, 3) *= weights[factor.pose];
  }
  for (const RigCamera& camera : data.rig->cameras) {
    problem.vehicle_from_camera.push_back(*camera.vehicle_from_camera);
  }
  problem.ground_observations =
      makeGroundObservations(options,
                             priors.uses_all_ground ? findGroundPoints(data, options.max_ground_distance_m)
                                                    : findPreciseGround(data, options.max_ground_distance_m),
                             weights, data);
  if (priors.height_sigma_m > 0.0) {
    problem.prior_vehicle_from_camera = problem.vehicle_from_camera;
    problem.extrinsics_information =
        commonHeightInformation(problem.vehicle_from_camera, priors.height_sigma_m);
  } else if (!priors.vehicle_from_camera.empty()) {
    problem.prior_vehicle_from_camera = priors.vehicle_from_camera;
    problem.extrinsics_information = priors.extrinsics_information;
  }
  if (priors.hasMap()) {
    problem.is_first_pose_fixed = false;
    for (size_t t = 0; t < data.tracks.size(); ++t) {
      if (data.tracks[t].position_m) {
        problem.point_information.push_back(priors.landmark_information[t]);
      }
    }
  }
  return problem;
}

}  // namespace

OdometryNoise estimateOdometryNoise(const RigAdjustmentOptions& options, const ReconstructionData& data) {
  OdometryNoise noise;
  if (data.keyframes.size() <= kMinMotions) {
    return noise;
  }
  std::array<std::vector<double>, 6> errors;
  for (size_t i = 1; i < data.keyframes.size(); ++i) {
    const RigidTransform counted =
        data.keyframes[i - 1].odom_from_vehicle.inverse() * data.keyframes[i].odom_from_vehicle;
    const RigidTransform seen =
        data.keyframes[i - 1].map_from_vehicle.inverse() * data.keyframes[i].map_from_vehicle;
    Vector6d error;
    error << seen.translation() - counted.translation(), vectorFromRotation(seen.rotation()).head<2>(),
        yawOfRotation(seen.rotation()) - data.odometry_turn_scale * yawOfRotation(counted.rotation());
    for (size_t axis = 0; axis < errors.size(); ++axis) {
      errors[axis].push_back(std::abs(error[static_cast<Eigen::Index>(axis)]));
    }
  }
  const BundleAdjustmentOptions& bundle = options.bundle;
  Vector6d least, most;
  least << kMinOdometrySigma_m, kMinOdometrySigma_m, kMinHeightSigma_m, kMinTiltSigma_rad, kMinTiltSigma_rad,
      kMinOdometrySigma_rad;
  most << bundle.odometry_sigma_m, bundle.odometry_sigma_m, bundle.height_sigma_m, bundle.tilt_sigma_rad,
      bundle.tilt_sigma_rad, bundle.odometry_sigma_rad;
  constexpr double kMedianOfNormal = 0.6745;  // of the absolute value of a standard normal variable
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    noise.sigmas[axis] = std::clamp(quantile(errors[static_cast<size_t>(axis)], 0.5) / kMedianOfNormal,
                                    least[axis], most[axis]);
  }
  noise.has_slipped.push_back(false);
  for (size_t i = 0; i + 1 < data.keyframes.size(); ++i) {
    noise.has_slipped.push_back(errors[0][i] > kSlipSigmas * noise.sigmas[0] ||
                                errors[1][i] > kSlipSigmas * noise.sigmas[1] ||
                                errors[5][i] > kSlipSigmas * noise.sigmas[5]);
  }
  return noise;
}

BundleAdjustmentSummary adjustRig(const RigAdjustmentOptions& options, const RigPriors& priors,
                                  ReconstructionData* data) {
  check(!data->keyframes.empty(), "adjustRig: expected keyframes");
  check(!priors.hasMap() || priors.landmark_information.size() == data->tracks.size(),
        "adjustRig: expected landmark_information of every track");
  BundleProblem problem = makeRigProblem(options, priors, *data);
  const std::vector<Eigen::Vector3d> before =
      priors.hasMap() ? problem.points_in_map : std::vector<Eigen::Vector3d>();
  const BundleSolution solved =
      solveBundle(options.bundle.max_iterations, options.bundle.cost_tolerance, &problem);
  if (priors.hasMap()) {
    problem.points_in_map = before;
  }
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

RigUncertainty rigUncertainty(const RigAdjustmentOptions& options, const RigPriors& priors,
                              const ReconstructionData& data) {
  RigUncertainty result;
  const BundleCovariance tail = bundleCovariance(makeRigProblem(options, priors, data));
  if (!tail.is_valid) {
    return result;
  }
  const Eigen::Index size = tail.covariance.rows() - 2;
  result.is_valid = true;
  result.with_odometer = tail.covariance;
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
