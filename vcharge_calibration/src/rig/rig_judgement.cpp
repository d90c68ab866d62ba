#include "rig/rig_judgement.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include <Eigen/Eigenvalues>

#include "rig/body_move.h"
#include "rig/ground.h"
#include "rig/rig_adjustment.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/camera/pixel_angle.h"
#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

// Units that make metres and radians comparable.
constexpr double kUnit_m = 0.01;
constexpr double kUnit_rad = 0.05 / 57.29577951308232;
constexpr double kDegrees = 57.29577951308232;
constexpr int kHalfIterations = 10;
constexpr double kJackknifeFactor = 2.0;
/// Least variance over that for independent errors, whose steps of a wheel counter cancel one another.
constexpr double kLeastRatio = 0.25;
/// The same for angles, which depend on the ground, and that is often smoother than assumed.
constexpr double kLeastAngleRatio = 0.05;
// Usual range of landmarks.
constexpr double kRange_m = 2.5;
// How a body stands on its wheels while it drives, beside how it stands at rest.
constexpr double kBodyHeight_m = 0.001;
constexpr double kBodyTilt_rad = 0.01 / 57.29577951308232;
/// How far an odometer's stamps are from when its wheels were where it says: they are read in periods, and
/// count in steps. No drive tells it from an offset of all clocks.
constexpr double kOdometerDelay_s = 0.0025;
/// Cosines between a camera's view and the side that its name says, and another side, of swapped cameras.
constexpr double kMaxOwnSide = 0.2, kMinOtherSide = 0.8;

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// RMS of a camera's reprojection errors, and of their mean in cells of the image.
class ErrorStatistics {
 public:
  explicit ErrorStatistics(cv::Size image_size_px)
      : size_px_(image_size_px),
        sums_(kColumns * kRows, Eigen::Vector2d::Zero()),
        counts_(kColumns * kRows, 0) {}

  void add(const Eigen::Vector2d& position_px, const Eigen::Vector2d& error_px) {
    const int column =
        std::clamp(static_cast<int>(kColumns * position_px.x() / size_px_.width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(kRows * position_px.y() / size_px_.height), 0, kRows - 1);
    sums_[row * kColumns + column] += error_px;
    ++counts_[row * kColumns + column];
    squares_ += error_px.squaredNorm();
    ++count_;
  }
  int64_t count() const { return count_; }
  double rms() const { return count_ == 0 ? 0.0 : std::sqrt(squares_ / (2.0 * static_cast<double>(count_))); }
  double structure() const {
    double square = 0.0, weight = 0.0;
    for (size_t i = 0; i < sums_.size(); ++i) {
      if (counts_[i] >= kMinPerCell) {
        // Subtracts the expected square of the mean of independent errors.
        square += std::max(0.0, sums_[i].squaredNorm() / counts_[i] - 2.0 * rms() * rms());
        weight += 2.0 * counts_[i];
      }
    }
    return weight == 0.0 ? 0.0 : std::sqrt(square / weight);
  }

 private:
  static constexpr int kColumns = 16, kRows = 10, kMinPerCell = 30;
  const cv::Size size_px_;
  std::vector<Eigen::Vector2d> sums_;
  std::vector<int> counts_;
  double squares_ = 0.0;
  int64_t count_ = 0;
};

void countObservations(const ReconstructionData& data, RigCalibration* result) {
  std::vector<ErrorStatistics> statistics;
  for (const RigCamera& camera : data.rig->cameras) {
    statistics.emplace_back(camera.image_size_px);
  }
  for (const Track& track : data.tracks) {
    if (!track.position_m) {
      continue;
    }
    ++result->num_landmarks;
    std::set<int32_t> cameras;
    for (const TrackObservation& observation : track.observations) {
      Eigen::Vector2d error_px;
      if (reprojectionError(data, track, observation, &error_px)) {
        statistics[observation.camera].add(observation.position_px, error_px);
        cameras.insert(observation.camera);
      }
    }
    for (const int32_t camera : cameras) {
      result->cameras[camera].num_common_landmarks += cameras.size() > 1 ? 1 : 0;
    }
  }
  for (size_t i = 0; i < statistics.size(); ++i) {
    result->cameras[i].num_observations = statistics[i].count();
    result->cameras[i].rms_px = statistics[i].rms();
    result->cameras[i].structure_px = statistics[i].structure();
  }
}

/// The rig from the odd or the even parts of the drive; odometry connects all keyframes.
std::shared_ptr<const CameraRig> calibrateHalf(const RigAdjustmentOptions& options, const RigPriors& priors,
                                               const ReconstructionData& data, bool odd) {
  ReconstructionData half;
  half.rig = data.rig;
  half.odometry_distance_scale = data.odometry_distance_scale;
  half.odometry_turn_scale = data.odometry_turn_scale;
  for (const Keyframe& keyframe : data.keyframes) {
    half.keyframes.emplace_back();
    half.keyframes.back().odom_from_vehicle = keyframe.odom_from_vehicle;
    half.keyframes.back().map_from_vehicle = keyframe.map_from_vehicle;
    half.keyframes.back().motion = keyframe.motion;
    half.keyframes.back().travelled_m = keyframe.travelled_m;
  }
  RigPriors half_priors;
  half_priors.odometry = priors.odometry;
  half_priors.height_sigma_m = priors.height_sigma_m;
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    const Track& track = data.tracks[t];
    if (track.position_m) {
      const double travelled_m = data.keyframes[track.observations.front().keyframe].travelled_m;
      if ((static_cast<int64_t>(travelled_m / kIndependent_m) % 2 == 1) == odd) {
        half.tracks.push_back(track);
        if (!priors.landmark_information.empty()) {
          half_priors.landmark_information.push_back(priors.landmark_information[t]);
        }
      }
    }
  }
  RigAdjustmentOptions quick = options;
  quick.bundle.max_iterations = kHalfIterations;
  adjustRig(quick, half_priors, &half);
  return half.rig;
}

/// Ratio of a camera's standard deviations to those for independent errors. The jackknife knows which errors
/// have a cause in common, but its residuals are smaller than the errors, because the adjustment has followed
/// half of these. It is noisy where few parts of the drive tell of a direction.
template <int kSize>
Eigen::Matrix<double, kSize, 1> inflationOf(const Eigen::Matrix<double, kSize, kSize>& independent,
                                            const Eigen::Matrix<double, kSize, kSize>& jackknife,
                                            const Eigen::Matrix<double, kSize, 1>& least_ratio) {
  const Eigen::Matrix<double, kSize, 1> ratio =
      kJackknifeFactor * jackknife.diagonal().cwiseQuotient(independent.diagonal());
  return ratio.cwiseMax(least_ratio).cwiseSqrt();
}

/// How a camera's image deviates. Errors that are common to the drive add to those by the jackknife: a shift
/// of an image differs from a turn of its camera at the rim only, where the difference is small.
IntrinsicsDeviation intrinsicsOf(const RigAdjustmentOptions& options, const RigPriors& priors,
                                 const RigCamera& adjusted, size_t camera,
                                 const RigUncertainty& uncertainty) {
  constexpr double kShiftOverDirection = 6.0, kRadius = 0.25;  // of the image's width
  const double shift_px = kShiftOverDirection * options.common_error_px;
  const ImageDeviation common(options.common_error_px / (kRadius * adjusted.image_size_px.width), shift_px,
                              shift_px);
  const auto at = static_cast<Eigen::Index>(3 * camera);
  const Eigen::Matrix3d independent = uncertainty.image_covariance.block<3, 3>(at, at);
  const Eigen::Vector3d inflation = inflationOf<3>(
      independent, uncertainty.image_jackknife.block<3, 3>(at, at), Eigen::Vector3d::Constant(kLeastRatio));
  const ImageDeviation variances =
      inflation.cwiseAbs2().cwiseProduct(independent.diagonal()) + common.cwiseAbs2();
  const ImageDeviation deviation = options.refine_intrinsics
                                       ? imageDeviation(adjusted.model, priors.models[camera])
                                       : uncertainty.image_deviations.segment<3>(at).eval();
  return {deviation, variances.cwiseSqrt(), priors.possible_image_sigmas[camera], options.refine_intrinsics};
}

/// When a camera exposes its images; the offset of all clocks is that of the odometry.
TimingEstimate timingOf(const RigAdjustmentOptions& options, const RigPriors& priors,
                        const RigCalibration& drive, const RigCamera& adjusted, size_t camera,
                        const TimingUncertainty& uncertainty) {
  const auto at = static_cast<Eigen::Index>(2 * camera);
  const Eigen::Matrix2d independent = uncertainty.covariance.block<2, 2>(at, at);
  const Eigen::Vector2d inflation = inflationOf<2>(independent, uncertainty.jackknife.block<2, 2>(at, at),
                                                   Eigen::Vector2d::Constant(kLeastRatio));
  TimingEstimate estimate{priors.timings[camera], adjusted.timing};
  estimate.is_corrected = options.refine_timing;
  estimate.sigmas = inflation.cwiseProduct(independent.diagonal().cwiseSqrt());
  if (estimate.is_corrected) {
    estimate.found.clock_offset_s += drive.time_offset_s;
    estimate.sigmas[1] = std::hypot(estimate.sigmas[1], drive.time_offset_sigma_s, kOdometerDelay_s);
  } else {
    estimate.found.readout_s += uncertainty.deviations[at];
    estimate.found.clock_offset_s += uncertainty.deviations[at + 1];
  }
  return estimate;
}

/// Covariance of what is the same in all parts of the drive: directions that all patches of a camera show,
/// and how the body stands on its wheels and on the ground that is seen, which moves all cameras.
Matrix6d commonCovariance(const RigAdjustmentOptions& options, const RigCamera& camera,
                          const GroundBias& ground) {
  const double sigma_rad = options.common_error_px * radiansPerPixel(camera);
  const double sigma_m = sigma_rad * kRange_m;
  Vector6d own;
  own << Eigen::Vector3d::Constant(sigma_m), Eigen::Vector3d::Constant(sigma_rad);
  Vector6d of_body;
  of_body << 0.0, 0.0, std::hypot(kBodyHeight_m, ground.height_m), std::hypot(kBodyTilt_rad, ground.roll_rad),
      std::hypot(kBodyTilt_rad, ground.pitch_rad), 0.0;
  const Matrix6d by_body = byMoveOfBody(*camera.vehicle_from_camera);
  Matrix6d covariance = by_body * of_body.cwiseAbs2().asDiagonal() * by_body.transpose();
  covariance.diagonal() += own.cwiseAbs2();
  return covariance;
}

/// Text of the longest axis of a camera's uncertainty.
std::string describeWeakest(const Matrix6d& covariance) {
  const char* const names[] = {"forwards", "sideways", "height", "roll", "pitch", "yaw"};
  Vector6d units;
  units << kUnit_m, kUnit_m, kUnit_m, kUnit_rad, kUnit_rad, kUnit_rad;
  const Matrix6d scaled = units.cwiseInverse().asDiagonal() * covariance * units.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaled);
  const Vector6d axis = eigen.eigenvectors().col(5);
  std::string text;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(axis[i]) > 0.4) {
      const double sigma = std::sqrt(eigen.eigenvalues()[5]) * std::abs(axis[i]) * units[i];
      text += (text.empty() ? "" : " together with ") + std::string(names[i]) + " (" +
              (i < 3 ? toText(100.0 * sigma, 2) + " cm" : toText(kDegrees * sigma, 3) + " degrees") + ")";
    }
  }
  return text;
}

}  // namespace

std::string describeFailure(const std::string& camera, const HandEye& initial, const RigCalibration& drive) {
  const std::string who = "camera '" + camera + "'";
  switch (initial.status) {
    case HandEyeStatus::kTooFewMotions:
      return who + ": too few images with tracked points (" + std::to_string(initial.num_motions) +
             " motions of " + std::to_string(drive.num_keyframes) +
             "): is it covered, dirty, or without light?";
    case HandEyeStatus::kNoTurn:
      return who + ": no turn: the drive turned " + toText(kDegrees * drive.left_turn_rad, 0) +
             " degrees to the left and " + toText(kDegrees * drive.right_turn_rad, 0) +
             " to the right; a straight drive shows neither the position of a camera nor its roll. "
             "Drive a figure of eight";
    case HandEyeStatus::kNoAgreement:
      return who + ": its motions contradict the odometer's (" + std::to_string(initial.num_inliers) +
             " of " + std::to_string(initial.num_motions) +
             " agree): check the intrinsics, the stamps, and the odometer's signs";
    case HandEyeStatus::kOk:
      break;
  }
  return who;
}

std::string findWrongSign(const CameraRig& rig) {
  const std::pair<const char*, Eigen::Vector2d> directions[] = {{"front", Eigen::Vector2d::UnitX()},
                                                                {"rear", -Eigen::Vector2d::UnitX()},
                                                                {"left", Eigen::Vector2d::UnitY()},
                                                                {"right", -Eigen::Vector2d::UnitY()}};
  bool all_over = true;
  int num_named = 0, num_round = 0;
  std::string misnamed;
  for (const RigCamera& camera : rig.cameras) {
    const Eigen::Matrix3d rotation = camera.vehicle_from_camera->rotationMatrix();
    all_over = all_over && rotation(2, 1) > 0.0;
    const Eigen::Vector2d view = rotation.col(2).head<2>();
    const auto own = std::find_if(std::begin(directions), std::end(directions),
                                  [&](const auto& direction) { return camera.name == direction.first; });
    if (own == std::end(directions)) {
      continue;
    }
    ++num_named;
    num_round += own->second.dot(view) < -0.3 ? 1 : 0;
    for (const auto& [name, direction] : directions) {
      if (own->second.dot(view) < kMaxOwnSide * view.norm() &&
          direction.dot(view) > kMinOtherSide * view.norm()) {
        misnamed += (misnamed.empty() ? "camera '" : ", camera '") + camera.name + "' looks to the " + name;
      }
    }
  }
  if (all_over) {
    return "all cameras would hang upside down: the odometer's turns have the wrong sign";
  }
  if (num_named > 0 && num_round == num_named) {
    return "all cameras would look opposite to their names: the odometer's direction of travel has the wrong "
           "sign";
  }
  return misnamed.empty() ? "" : misnamed + ": are cameras swapped? Check their cables and topics";
}

void judgeRig(const RigAdjustmentOptions& options, const RigPriors& priors, const ReconstructionState& state,
              RigCalibration* result) {
  const ReconstructionData& data = state.data;
  result->rms_px = state.report.rms_px;
  result->odometer_turn_scale = data.odometry_turn_scale;
  for (const LoopEdge& edge : state.report.loop_edges) {
    result->num_loop_edges += edge.accepted ? 1 : 0;
  }
  countObservations(data, result);
  const std::vector<GroundPoint> ground = findPreciseGround(data, options.max_ground_distance_m);
  const GroundBias ground_bias = findGroundBias(data, ground);
  result->height_source = "from " + std::to_string(ground.size()) + " landmarks on the ground near the path";
  if (result->is_from_map) {
    result->height_source += ", and from the ground of the map";
  }
  auto rig = std::make_shared<CameraRig>(*data.rig);
  rig->scale_sigma = options.scale_sigma;
  const RigUncertainty uncertainty = rigUncertainty(options, priors, data);
  Vector6d least_ratio;
  least_ratio << Eigen::Vector3d::Constant(kLeastRatio), Eigen::Vector3d::Constant(kLeastAngleRatio);
  const TimingUncertainty timing = timingUncertainty(options, priors, data);
  const auto odd = calibrateHalf(options, priors, data, true);
  const auto even = calibrateHalf(options, priors, data, false);
  for (size_t i = 0; i < rig->cameras.size(); ++i) {
    CameraCalibration& camera = result->cameras[i];
    camera.half_difference =
        stepBetween(*even->cameras[i].vehicle_from_camera, *odd->cameras[i].vehicle_from_camera);
    if (uncertainty.is_valid) {
      const auto at = static_cast<Eigen::Index>(6 * i);
      const Matrix6d schur = uncertainty.covariance.block<6, 6>(at, at);
      camera.inflation = inflationOf<6>(schur, uncertainty.jackknife.block<6, 6>(at, at), least_ratio);
      camera.covariance = camera.inflation.asDiagonal() * schur * camera.inflation.asDiagonal();
      camera.covariance += uncertainty.by_intrinsics.block<6, 6>(at, at);
      camera.covariance += commonCovariance(options, rig->cameras[i], ground_bias);
      camera.weakest_direction = describeWeakest(camera.covariance);
      rig->cameras[i].covariance = camera.covariance;
      if (!priors.models.empty()) {
        camera.intrinsics = intrinsicsOf(options, priors, rig->cameras[i], i, uncertainty);
        if (camera.intrinsics->is_corrected) {
          rig->cameras[i].focal_sigma = camera.intrinsics->sigmas[0];
          rig->cameras[i].principal_point_sigma_px = camera.intrinsics->sigmas.tail<2>().maxCoeff();
        }
      }
    }
  }
  for (size_t i = 0; i < rig->cameras.size() && timing.deviations.size() > 0; ++i) {
    const TimingEstimate estimate = timingOf(options, priors, *result, rig->cameras[i], i, timing);
    if (estimate.is_corrected) {
      rig->cameras[i].timing = estimate.found.normalized();
    }
    result->cameras[i].timing = estimate;
  }
  result->rig = rig;
  findVerdict(result);
  if (result->verdict == Verdict::kFail) {
    result->rig.reset();
  }
}

}  // namespace vcharge
