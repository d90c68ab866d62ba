#include "vcharge_calibration/monitor/rig_deviation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "matching/inter_camera_matching.h"
#include "rig/rig_adjustment.h"
#include "vcharge_core/motion/pose_step.h"
#include "vcharge_reconstruction/landmarks/landmark_alignment.h"
#include "vcharge_reconstruction/landmarks/landmark_search.h"
#include "vcharge_reconstruction/landmarks/triangulation.h"

namespace vcharge {
namespace {

// Deviations for which the adjustment is made; they keep what a short drive does not show near the rig.
constexpr double kPrior_m = 0.05;
constexpr double kPrior_rad = 0.03;
constexpr double kOdometerPrior = 0.02;
/// A part with fewer keyframes is not adjusted.
constexpr size_t kMinKeyframes = 5;
/// Factor on the cost tolerance of the last adjustment: the cost depends only weakly on the extrinsics.
constexpr double kFineToleranceFactor = 0.1;
/// Factor on the variances of an adjustment, whose observations are not independent. With it, the deviations
/// of the parts of steady drives scatter by 0.7 to 0.85 of their sigmas, and some parts by twice their
/// sigmas.
constexpr double kDependence = 2.0;
// Errors of the odometer's heading: per square root of a metre, and relative to the turn.
constexpr double kTurnWalk_rad = 0.0006;
constexpr double kTurnError = 0.003;
constexpr double kMinLength_m = 1.0;

// The unknowns of an adjustment: the odometer's factors for distance and turn, then [dt, dphi] of each
// camera.
constexpr Eigen::Index kNumFactors = 2;

Eigen::VectorXd priorInformation(size_t num_cameras) {
  Eigen::VectorXd information(kNumFactors + 6 * static_cast<Eigen::Index>(num_cameras));
  information.head<kNumFactors>().setConstant(1.0 / (kOdometerPrior * kOdometerPrior));
  for (size_t i = 0; i < num_cameras; ++i) {
    information.segment<6>(kNumFactors + 6 * static_cast<Eigen::Index>(i))
        << Eigen::Vector3d::Constant(1.0 / (kPrior_m * kPrior_m)),
        Eigen::Vector3d::Constant(1.0 / (kPrior_rad * kPrior_rad));
  }
  return information;
}

Eigen::VectorXd deviationFrom(const CameraRig& rig, const ReconstructionData& adjusted) {
  Eigen::VectorXd deviation(kNumFactors + 6 * static_cast<Eigen::Index>(rig.cameras.size()));
  deviation.head<kNumFactors>() << adjusted.odometry_distance_scale - 1.0, adjusted.odometry_turn_scale - 1.0;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    deviation.segment<6>(kNumFactors + 6 * static_cast<Eigen::Index>(i)) =
        stepBetween(*rig.cameras[i].vehicle_from_camera, *adjusted.rig->cameras[i].vehicle_from_camera);
  }
  return deviation;
}

/// Turn per metre that the odometer did not count, and its variance.
struct TurnPerMetre {
  double mean_rad = 0.0, variance_rad2 = INFINITY;
};

TurnPerMetre measureTurnPerMetre(const ReconstructionData& adjusted) {
  const std::vector<Keyframe>& keyframes = adjusted.keyframes;
  const double length_m = keyframes.back().travelled_m - keyframes.front().travelled_m;
  if (length_m < kMinLength_m) {
    return {};
  }
  double sum_rad = 0.0, squares_rad2 = 0.0, turn_rad = 0.0;
  for (size_t i = 1; i < keyframes.size(); ++i) {
    const double counted_rad = yawOfRotation(keyframes[i - 1].odom_from_vehicle.rotation().conjugate() *
                                             keyframes[i].odom_from_vehicle.rotation());
    const double seen_rad = yawOfRotation(keyframes[i - 1].map_from_vehicle.rotation().conjugate() *
                                          keyframes[i].map_from_vehicle.rotation());
    const double error_rad = seen_rad - adjusted.odometry_turn_scale * counted_rad;
    sum_rad += error_rad;
    squares_rad2 += error_rad * error_rad;
    turn_rad += std::abs(counted_rad);
  }
  const double num_motions = static_cast<double>(keyframes.size()) - 1.0;
  const double scatter_rad2 = squares_rad2 - sum_rad * sum_rad / num_motions;
  const double variance_rad2 = std::max(scatter_rad2, kTurnWalk_rad * kTurnWalk_rad * length_m) +
                               kTurnError * kTurnError * turn_rad * turn_rad;
  return {sum_rad / length_m, variance_rad2 / (length_m * length_m)};
}

class PartAdjuster {
 public:
  PartAdjuster(const RigCalibratorOptions& options, const KeyframeImages& images, ReconstructionData* part)
      : options_(options), images_(images), rig_(part->rig), part_(part) {
    options_.adjustment.bundle.odometer_scale_sigma = kOdometerPrior;
    options_.adjustment.bundle.odometer_turn_sigma = kOdometerPrior;
    const Eigen::VectorXd prior = priorInformation(rig_->cameras.size());
    priors_.extrinsics_information = prior.tail(prior.size() - kNumFactors).asDiagonal();
    priors_.uses_all_ground = true;
    for (const RigCamera& camera : rig_->cameras) {
      priors_.vehicle_from_camera.push_back(*camera.vehicle_from_camera);
    }
  }

  void adjust() {
    triangulateTracks(options_.firstTriangulation(), part_);
    RigAdjustmentOptions lenient = options_.adjustment;
    lenient.bundle.outlier_sigmas = INFINITY;
    adjustRig(lenient, priors_, part_);
    triangulateTracks(options_.triangulation, part_);
    adjustRig(options_.adjustment, priors_, part_);
    matchBetweenCameras(options_.inter_camera, images_, part_);
    searchLandmarks(options_.search, part_);
    adjustRig(options_.adjustment, priors_, part_);
    alignLandmarks(options_.landmark_alignment, images_, part_);
    RigAdjustmentOptions fine = options_.adjustment;
    fine.bundle.cost_tolerance *= kFineToleranceFactor;
    adjustRig(fine, priors_, part_);
  }

  void read(RigDeviation* result) const {
    const RigUncertainty uncertainty = rigUncertainty(options_.adjustment, priors_, *part_);
    if (!uncertainty.is_valid) {
      return;
    }
    const Eigen::Index size = uncertainty.with_odometer.rows(), of_cameras = size - kNumFactors;
    Eigen::MatrixXd information =
        uncertainty.with_odometer.llt().solve(Eigen::MatrixXd::Identity(size, size));
    if (!information.allFinite()) {
      return;
    }
    const Eigen::VectorXd vector = information * deviationFrom(*rig_, *part_) / kDependence;
    information.diagonal() -= priorInformation(rig_->cameras.size());
    information /= kDependence;
    const TurnPerMetre turn = measureTurnPerMetre(*part_);
    result->information_vector << vector.head<kNumFactors>(), turn.mean_rad / turn.variance_rad2,
        vector.tail(of_cameras);
    result->information(kNumFactors, kNumFactors) = 1.0 / turn.variance_rad2;
    result->information.topLeftCorner<kNumFactors, kNumFactors>() =
        information.topLeftCorner<kNumFactors, kNumFactors>();
    result->information.topRightCorner(kNumFactors, of_cameras) =
        information.topRightCorner(kNumFactors, of_cameras);
    result->information.bottomLeftCorner(of_cameras, kNumFactors) =
        information.bottomLeftCorner(of_cameras, kNumFactors);
    result->information.bottomRightCorner(of_cameras, of_cameras) =
        information.bottomRightCorner(of_cameras, of_cameras);
    result->pitch.add(part_->keyframes);
    for (const Track& track : part_->tracks) {
      for (const TrackObservation& observation : track.observations) {
        result->num_observations[observation.camera] += track.position_m ? 1 : 0;
      }
    }
  }

 private:
  RigCalibratorOptions options_;
  const KeyframeImages& images_;
  const std::shared_ptr<const CameraRig> rig_;
  ReconstructionData* const part_;
  RigPriors priors_;
};

}  // namespace

// The camera is eliminated from the normal equations, and becomes unknown.
void forgetCamera(size_t camera, RigDeviation* deviation) {
  const Eigen::Index row = RigDeviation::rowOf(camera);
  const Eigen::Matrix<double, 6, 6> own = deviation->information.block<6, 6>(row, row);
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> factorized(own);
  const Eigen::MatrixXd with_others = deviation->information.middleCols<6>(row);
  const Eigen::MatrixXd over_own = factorized.solve(with_others.transpose()).transpose();
  if (over_own.allFinite()) {
    deviation->information_vector -= over_own * deviation->information_vector.segment<6>(row);
    deviation->information -= over_own * with_others.transpose();
  }
  deviation->information_vector.segment<6>(row).setZero();
  deviation->information.middleCols<6>(row).setZero();
  deviation->information.middleRows<6>(row).setZero();
}

RigDeviation estimateDeviation(const RigCalibratorOptions& options, const KeyframeImages& images,
                               ReconstructionData part) {
  RigDeviation result;
  const Eigen::Index size = RigDeviation::rowOf(part.rig->cameras.size());
  result.information_vector.setZero(size);
  result.information.setZero(size, size);
  result.num_observations.assign(part.rig->cameras.size(), 0);
  if (part.keyframes.empty()) {
    return result;
  }
  result.begin = part.keyframes.front().stamp;
  result.end = part.keyframes.back().stamp;
  result.begin_m = part.keyframes.front().travelled_m;
  result.end_m = part.keyframes.back().travelled_m;
  if (part.keyframes.size() < kMinKeyframes) {
    return result;
  }
  PartAdjuster adjuster(options, images, &part);
  adjuster.adjust();
  adjuster.read(&result);
  return result;
}

}  // namespace vcharge
