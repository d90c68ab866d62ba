#include "initialization/rig_initialization.h"

#include <cmath>

#include "rig/rig_judgement.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

/// Minimum ratio of keyframes at which the motion of a camera must be known.
constexpr double kMinSeenRatio = 0.2;
constexpr double kMinDistance_m = 5.0;
/// Smaller offsets are ignored: the distance driven during them is below the accuracy of the extrinsics.
constexpr double kMinOffset_s = 0.004;
constexpr int kOffsetIterations = 3;

/// Adds a time offset to the result and shifts the odometry; false if the addition is not significant.
bool addTimeOffset(const TimeOffset& more, const OdometrySeries& series, ReconstructionState* state,
                   RigCalibration* result) {
  const bool has_offset = result->time_offset_s != 0.0;
  if (!has_offset && !(more.isSignificant() && std::abs(more.offset_s) > kMinOffset_s)) {
    return false;
  }
  result->time_offset_s += more.offset_s;
  series.shift(result->time_offset_s, state);
  return true;
}

std::shared_ptr<CameraRig> solveHandEyes(const ReconstructionData& data,
                                         const std::vector<std::vector<MotionPair>>& motions,
                                         const HandEyeOptions& options, RigCalibration* result) {
  auto rig = std::make_shared<CameraRig>(*data.rig);
  std::vector<std::string> failures;
  for (size_t i = 0; i < rig->cameras.size(); ++i) {
    HandEye& initial = result->cameras[i].initial;
    initial = solvePlanarHandEye(motions[i], options);
    if (kMinSeenRatio * static_cast<double>(data.keyframes.size()) > static_cast<double>(motions[i].size())) {
      initial.status = HandEyeStatus::kTooFewMotions;
    }
    if (initial.status != HandEyeStatus::kOk) {
      failures.push_back(describeFailure(rig->cameras[i].name, initial, *result));
    }
    rig->cameras[i].vehicle_from_camera = initial.vehicle_from_camera;
  }
  if (!failures.empty()) {
    throw NotCalibrated{failures};
  }
  const std::string wrong_sign = findWrongSign(*rig);
  if (!wrong_sign.empty()) {
    throw NotCalibrated{{wrong_sign}};
  }
  return rig;
}

}  // namespace

void describeDrive(const ReconstructionState& state, RigCalibration* result) {
  for (const RigCamera& camera : state.data.rig->cameras) {
    result->cameras.emplace_back();
    result->cameras.back().name = camera.name;
  }
  const std::vector<Keyframe>& keyframes = state.data.keyframes;
  result->num_keyframes = static_cast<int>(keyframes.size());
  for (size_t i = 1; i < keyframes.size(); ++i) {
    const RigidTransform motion =
        keyframes[i - 1].odom_from_vehicle.inverse() * keyframes[i].odom_from_vehicle;
    const double turn_rad = yawOfRotation(motion.rotation());
    (turn_rad > 0.0 ? result->left_turn_rad : result->right_turn_rad) += std::abs(turn_rad);
  }
  if (!keyframes.empty()) {
    result->distance_m = keyframes.back().travelled_m;
  }
  const ReconstructionReport& report = state.report;
  if (2 * report.counters.frames_without_odometry > report.counters.frames) {
    throw NotCalibrated{
        {"most images have no odometry at their stamps: do cameras and odometer use the same clock?"}};
  }
  if (keyframes.empty()) {
    throw NotCalibrated{{"no images in the drive"}};
  }
  if (result->distance_m < kMinDistance_m) {
    throw NotCalibrated{{"the vehicle stood: by the odometer it moved " + toText(result->distance_m, 1) +
                         " m. Drive 100 m or more, with turns to both sides"}};
  }
}

std::shared_ptr<CameraRig> estimateInitialRig(const OdometrySeries& series, const HandEyeOptions& options,
                                              std::vector<std::vector<MotionPair>> motions,
                                              ReconstructionState* state, RigCalibration* result) {
  std::shared_ptr<CameraRig> rig = solveHandEyes(state->data, motions, options, result);
  for (int i = 0; i < kOffsetIterations; ++i) {
    std::vector<Eigen::Vector3d> up_in_camera;
    for (const RigCamera& camera : rig->cameras) {
      up_in_camera.emplace_back(camera.vehicle_from_camera->rotation().conjugate() *
                                Eigen::Vector3d::UnitZ());
    }
    if (!addTimeOffset(estimateTimeOffset(*state, motions, up_in_camera), series, state, result)) {
      break;
    }
    const std::vector<Keyframe>& keyframes = state->data.keyframes;
    for (std::vector<MotionPair>& of_camera : motions) {
      for (MotionPair& motion : of_camera) {
        motion.vehicle = keyframes[motion.keyframe].odom_from_vehicle.inverse() *
                         keyframes[motion.keyframe + 1].odom_from_vehicle;
      }
    }
    rig = solveHandEyes(state->data, motions, options, result);
  }
  return rig;
}

void correctTimeOffset(const OdometrySeries& series, ReconstructionState* state, RigCalibration* result) {
  const TimeOffset more = refineTimeOffset(series, result->time_offset_s, state->data);
  result->time_offset_sigma_s = more.sigma_s;
  addTimeOffset(more, series, state, result);
}

}  // namespace vcharge
