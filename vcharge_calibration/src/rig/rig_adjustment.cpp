#include "rig/rig_adjustment.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "rig/ground.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Larger turns between keyframes tilt the body.
constexpr double kMinTurn_rad = 0.01;
/// Usual changes of a lens by heat or by focusing: of the focal length, and of the principal point over the
/// image's width.
constexpr double kFocalChange = 0.003, kPrincipalPointChange = 0.0015;
/// Timing that a rig does not tell: rolling shutters take up to 30 ms, and a frame takes 80 ms.
constexpr double kReadoutChange_s = 0.03, kClockOffsetChange_s = 0.03;

/// Counted turn from the keyframe before to each keyframe.
std::vector<double> turnsTo(const std::vector<Keyframe>& keyframes) {
  std::vector<double> turns_rad(keyframes.size(), 0.0);
  for (size_t i = 1; i < keyframes.size(); ++i) {
    turns_rad[i] = yawOfRotation(keyframes[i - 1].odom_from_vehicle.rotation().conjugate() *
                                 keyframes[i].odom_from_vehicle.rotation());
  }
  return turns_rad;
}

/// Weights of the keyframes for the cameras' tilt. The body tilts outwards in turns, which cancels if left
/// and right have the same sum of weights: the side with more turns gets less weight.
std::vector<double> balanceTurns(const ReconstructionData& data) {
  const std::vector<double> turns_rad = turnsTo(data.keyframes);
  double left_rad = 0.0, right_rad = 0.0;
  for (const double turn_rad : turns_rad) {
    (turn_rad > 0.0 ? left_rad : right_rad) += std::abs(turn_rad);
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

/// Unknown deviations of the images from the rig's present models, around the known ones.
void addImageDeviations(const RigPriors& priors, const CameraRig& rig, BundleProblem* problem) {
  for (size_t i = 0; i < priors.models.size(); ++i) {
    problem->image_deviations.emplace_back(ImageDeviation::Zero());
    problem->prior_image_deviations.emplace_back(-imageDeviation(rig.cameras[i].model, priors.models[i]));
    problem->image_deviation_sigmas.push_back(priors.possible_image_sigmas[i]);
  }
}

/// Unknown deviations of the timing from the rig's present one, around the known one.
void addTimingDeviations(const RigPriors& priors, const CameraRig& rig, BundleProblem* problem) {
  for (size_t i = 0; i < priors.timings.size(); ++i) {
    const ImageTiming& present = rig.cameras[i].timing;
    problem->timing_deviations.emplace_back(TimingDeviation::Zero());
    problem->prior_timing_deviations.emplace_back(priors.timings[i].readout_s - present.readout_s,
                                                  priors.timings[i].clock_offset_s - present.clock_offset_s);
    problem->timing_deviation_sigmas.emplace_back(kReadoutChange_s, kClockOffsetChange_s);
  }
}

/// Builds the bundle adjustment with unknown extrinsics, ground observations and priors.
BundleProblem makeRigProblem(const RigAdjustmentOptions& options, const RigPriors& priors,
                             const ReconstructionData& data) {
  BundleProblem problem = makeBundleProblem(options.bundle, data, priors.odometry);
  const std::vector<double> weights = balanceTurns(data);
  for (OdometerFactor& factor : problem.odometer_factors) {
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

/// Covariance from how much the segments of a drive contradict each other. `influence`: of each keyframe on
/// the unknowns. Their mean does not count: it is zero after an adjustment, and the change by one that is to
/// come. What grows with a segment's turn is left out as well: the body leans outwards, and balanceTurns()
/// lets both sides cancel.
Eigen::MatrixXd jackknife(const ReconstructionData& data, const Eigen::MatrixXd& influence) {
  const std::vector<double> turn_to = turnsTo(data.keyframes);
  std::vector<Eigen::VectorXd> segments;
  std::vector<double> turns_rad;
  double begin_m = -INFINITY;
  for (size_t i = 0; i < data.keyframes.size(); ++i) {
    if (data.keyframes[i].travelled_m - begin_m > kIndependent_m) {
      begin_m = data.keyframes[i].travelled_m;
      segments.emplace_back(Eigen::VectorXd::Zero(influence.rows()));
      turns_rad.push_back(0.0);
    }
    segments.back() += influence.col(static_cast<Eigen::Index>(i));
    turns_rad.back() += turn_to[i];
  }
  Eigen::VectorXd with_turn = Eigen::VectorXd::Zero(influence.rows());
  double squares_rad2 = 0.0;
  const Eigen::VectorXd mean = influence.rowwise().sum() / static_cast<double>(segments.size());
  for (size_t i = 0; i < segments.size(); ++i) {
    segments[i] -= mean;
    with_turn += turns_rad[i] * segments[i];
    squares_rad2 += turns_rad[i] * turns_rad[i];
  }
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(influence.rows(), influence.rows());
  for (size_t i = 0; i < segments.size(); ++i) {
    const Eigen::VectorXd rest =
        squares_rad2 > 0.0 ? segments[i] - turns_rad[i] / squares_rad2 * with_turn : segments[i];
    covariance += rest * rest.transpose();
  }
  const auto count = static_cast<double>(segments.size());
  return count > 2.0 ? (covariance * (count / (count - 2.0))).eval() : covariance;
}

/// Takes the images' deviations out of the unknowns. Returns the covariance of the others by deviations that
/// are as large as stated: extrinsics make up for them.
Eigen::MatrixXd keepImages(const RigPriors& priors, const std::vector<Eigen::Index>& others,
                           const std::vector<Eigen::Index>& deviations, BundleCovariance* tail) {
  const Eigen::Index size = tail->covariance.rows();
  const Eigen::MatrixXd information = tail->covariance.llt().solve(Eigen::MatrixXd::Identity(size, size));
  const Eigen::MatrixXd gradients = information * tail->influence;
  const auto num_others = static_cast<Eigen::Index>(others.size());
  const Eigen::MatrixXd certain =
      information(others, others).llt().solve(Eigen::MatrixXd::Identity(num_others, num_others));
  Eigen::VectorXd variances(static_cast<Eigen::Index>(deviations.size()));
  for (size_t i = 0; i < priors.stated_image_sigmas.size(); ++i) {
    variances.segment<3>(static_cast<Eigen::Index>(3 * i)) = priors.stated_image_sigmas[i].cwiseAbs2();
  }
  const Eigen::MatrixXd by_deviations = certain * information(others, deviations);
  tail->covariance(others, others) = certain;
  tail->influence(others, Eigen::all) = certain * gradients(others, Eigen::all);
  return by_deviations * variances.asDiagonal() * by_deviations.transpose();
}

}  // namespace

void addKnownCameras(const CameraRig& rig, RigPriors* priors) {
  for (const RigCamera& camera : rig.cameras) {
    const double shift_px = kPrincipalPointChange * camera.image_size_px.width;
    const ImageDeviation stated(camera.focal_sigma, camera.principal_point_sigma_px,
                                camera.principal_point_sigma_px);
    const ImageDeviation change(kFocalChange, shift_px, shift_px);
    priors->models.push_back(camera.model);
    priors->timings.push_back(camera.timing);
    priors->stated_image_sigmas.push_back(stated);
    priors->possible_image_sigmas.emplace_back((stated.cwiseAbs2() + change.cwiseAbs2()).cwiseSqrt());
  }
}

ImageDeviation imageDeviation(const CameraModel& camera, const CameraModel& known) {
  const auto focalLength = [](const CameraModel& model) {
    return model.visit([](const auto& m) { return m.parameters()[m.kFocalLengths]; });
  };
  ImageDeviation deviation;
  deviation << std::log(focalLength(camera) / focalLength(known)),
      camera.principalPoint() - known.principalPoint();
  return deviation;
}

BundleAdjustmentSummary adjustRig(const RigAdjustmentOptions& options, const RigPriors& priors,
                                  ReconstructionData* data) {
  check(!data->keyframes.empty(), "adjustRig: expected keyframes");
  check(!priors.hasMap() || priors.landmark_information.size() == data->tracks.size(),
        "adjustRig: expected landmark_information of every track");
  BundleProblem problem = makeRigProblem(options, priors, *data);
  if (options.refine_intrinsics) {
    addImageDeviations(priors, *data->rig, &problem);
  }
  if (options.refine_timing) {
    addTimingDeviations(priors, *data->rig, &problem);
  }
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
    if (!problem.image_deviations.empty()) {
      const ImageDeviation& deviation = problem.image_deviations[i];
      rig->cameras[i].model = rig->cameras[i].model.withImage(std::exp(deviation[0]), deviation.tail<2>());
    }
    if (!problem.timing_deviations.empty()) {
      rig->cameras[i].timing.readout_s += problem.timing_deviations[i][0];
      rig->cameras[i].timing.clock_offset_s += problem.timing_deviations[i][1];
    }
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
  BundleProblem problem = makeRigProblem(options, priors, data);
  addImageDeviations(priors, *data.rig, &problem);
  if (options.refine_timing) {
    addTimingDeviations(priors, *data.rig, &problem);
  }
  BundleCovariance tail = bundleCovariance(problem);
  if (!tail.is_valid) {
    return result;
  }
  std::vector<Eigen::Index> with_odometer{0, 1}, deviations;
  for (Eigen::Index row = 2; row < tail.covariance.rows();) {
    for (int i = 0; i < 6; ++i) {
      with_odometer.push_back(row++);
    }
    for (int i = 0; i < 3 && !problem.image_deviations.empty(); ++i) {
      deviations.push_back(row++);
    }
    row += problem.timing_deviations.empty() ? 0 : 2;
  }
  const auto size = static_cast<Eigen::Index>(with_odometer.size()) - 2;
  result.is_valid = true;
  result.by_intrinsics = Eigen::MatrixXd::Zero(size, size);
  if (!deviations.empty()) {
    result.image_deviations = tail.influence(deviations, Eigen::all).rowwise().sum();
    result.image_covariance = tail.covariance(deviations, deviations);
    result.image_jackknife = jackknife(data, tail.influence(deviations, Eigen::all));
    if (!options.refine_intrinsics) {
      result.by_intrinsics =
          keepImages(priors, with_odometer, deviations, &tail).bottomRightCorner(size, size);
    }
  }
  result.with_odometer = tail.covariance(with_odometer, with_odometer);
  result.covariance = result.with_odometer.bottomRightCorner(size, size);
  result.jackknife = jackknife(data, tail.influence(with_odometer, Eigen::all)).bottomRightCorner(size, size);
  return result;
}

TimingUncertainty timingUncertainty(const RigAdjustmentOptions& options, const RigPriors& priors,
                                    const ReconstructionData& data) {
  BundleProblem problem = makeRigProblem(options, priors, data);
  addTimingDeviations(priors, *data.rig, &problem);
  const BundleCovariance tail = bundleCovariance(problem);
  TimingUncertainty result;
  if (!tail.is_valid || problem.timing_deviations.empty()) {
    return result;
  }
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 2; row < tail.covariance.rows(); row += 8) {
    rows.push_back(row + 6);
    rows.push_back(row + 7);
  }
  result.deviations = tail.influence(rows, Eigen::all).rowwise().sum();
  result.covariance = tail.covariance(rows, rows);
  result.jackknife = jackknife(data, tail.influence(rows, Eigen::all));
  return result;
}

}  // namespace vcharge
