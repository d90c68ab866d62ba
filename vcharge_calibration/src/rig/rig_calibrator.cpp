#include "vcharge_calibration/rig/rig_calibrator.h"

#include <utility>

#include <tbb/parallel_for.h>

#include "rig/rig_back_end.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"
#include "vcharge_reconstruction/map_assembly.h"

namespace vcharge {
namespace {

std::shared_ptr<const CameraRig> withoutExtrinsics(const CameraRig& rig) {
  auto result = std::make_shared<CameraRig>(rig);
  for (RigCamera& camera : result->cameras) {
    camera.vehicle_from_camera.reset();
    camera.covariance.reset();
  }
  return result;
}

}  // namespace

RobustOptions RigCalibratorOptions::defaultCameraMotion() {
  RobustOptions options;
  options.max_error_rad = 0.003;
  options.max_iterations = 300;
  options.min_inliers = 20;
  return options;
}

RigAdjustmentOptions RigCalibratorOptions::defaultAdjustment() {
  RigAdjustmentOptions options;
  options.bundle.odometer_scale_sigma = 1e-7;
  return options;
}

void RigCalibratorOptions::validate() const {
  requireField(frame_distance_m >= 0.0, "frame_distance_m", "must not be negative", frame_distance_m);
  requireField(frame_turn_rad >= 0.0, "frame_turn_rad", "must not be negative", frame_turn_rad);
  requireField(keyframe_distance_m > 0.0, "keyframe_distance_m", "must be positive", keyframe_distance_m);
  requireField(keyframe_turn_rad > 0.0, "keyframe_turn_rad", "must be positive", keyframe_turn_rad);
  requireField(max_speed_m_per_s > 0.0, "max_speed_m_per_s", "must be positive", max_speed_m_per_s);
  requireField(first_max_error_rad > 0.0, "first_max_error_rad", "must be positive", first_max_error_rad);
  validateInner("features", features);
  validateInner("tracker", tracker);
  validateInner("camera_motion", camera_motion);
  validateInner("hand_eye", hand_eye);
  validateInner("triangulation", triangulation);
  validateInner("loops", loops);
  validateInner("search", search);
  validateInner("inter_camera", inter_camera);
  validateInner("landmark_alignment", landmark_alignment);
  validateInner("adjustment", adjustment);
}

RigCalibrator::RigCalibrator(const std::shared_ptr<const CameraRig>& rig, const RigCalibratorOptions& options)
    : options_(options), extractor_(makeFeatureExtractor(options.features)) {
  options_.validate();
  check(rig != nullptr, "RigCalibrator: expected a rig");
  if (rig->cameras.empty()) {
    throw InputError("rig: expected a camera");
  }
  rig_ = withoutExtrinsics(*rig);
  state_.data.rig = rig_;
  gatherer_ = std::make_unique<FrameGatherer>(
      rig_, options_.max_speed_m_per_s, &state_.report,
      [this](Timestamp stamp, const std::vector<Image>& images, const RigidTransform& odom_from_vehicle) {
        processFrame(stamp, images, odom_from_vehicle);
      });
  for (const RigCamera& camera : rig_->cameras) {
    trackers_.emplace_back(camera, options_.tracker);
  }
}

RigCalibrator::~RigCalibrator() = default;

void RigCalibrator::processFrame(Timestamp stamp, const std::vector<Image>& images,
                                 const RigidTransform& odom_from_vehicle) {
  const StageTimer timer("following", &state_.report.stage_s);
  const RigidTransform motion =
      last_odom_from_vehicle_ ? last_odom_from_vehicle_->inverse() * odom_from_vehicle : RigidTransform();
  const double distance_m = motion.translation().norm();
  if (last_odom_from_vehicle_ && distance_m < options_.frame_distance_m &&
      angleOfRotation(motion.rotation()) < options_.frame_turn_rad) {
    ++state_.report.num_standing_frames;
    gatherer_->noteSkipped(stamp, "standing");
    return;
  }
  last_odom_from_vehicle_ = odom_from_vehicle;
  travelled_m_ += distance_m;
  tbb::parallel_for(size_t{0}, trackers_.size(), [&](size_t i) {
    std::vector<RayMatch> matches;
    trackers_[i].track(images[i], motion, static_cast<int>(i), &matches);
  });
  if (state_.data.keyframes.empty()) {
    addKeyframe(stamp, images, odom_from_vehicle);
    return;
  }
  const RigidTransform since = state_.data.keyframes.back().odom_from_vehicle.inverse() * odom_from_vehicle;
  if (since.translation().norm() >= options_.keyframe_distance_m ||
      angleOfRotation(since.rotation()) >= options_.keyframe_turn_rad) {
    addKeyframe(stamp, images, odom_from_vehicle);
  } else {
    state_.frames.push_back(
        {stamp, static_cast<int32_t>(state_.data.keyframes.size()) - 1, since, MotionHypothesis::kOdometry});
  }
}

void RigCalibrator::addKeyframe(Timestamp stamp, const std::vector<Image>& images,
                                const RigidTransform& odom_from_vehicle) {
  std::vector<Keyframe>& keyframes = state_.data.keyframes;
  const auto index = static_cast<int32_t>(keyframes.size());
  Keyframe keyframe;
  keyframe.stamp = stamp;
  keyframe.odom_from_vehicle = odom_from_vehicle;
  if (index > 0) {
    const RigidTransform step = keyframes.back().odom_from_vehicle.inverse() * odom_from_vehicle;
    keyframe.map_from_vehicle = keyframes.back().map_from_vehicle * step;
    state_.keyframe_from_next.push_back(step);
  }
  keyframe.travelled_m = travelled_m_;
  keyframe.images.resize(rig_->cameras.size());
  keyframes.push_back(std::move(keyframe));
  for (size_t i = 0; i < trackers_.size(); ++i) {
    trackers_[i].addKeyframe(index, static_cast<int32_t>(i), *extractor_, &state_.data);
  }
  images_.add(index, images);
  if (options_.landmark_alignment.enabled ||
      (options_.inter_camera.enabled && index % options_.inter_camera.keyframe_step == 0)) {
    all_images_.add(index, images);
  }
  state_.frames.push_back({stamp, index, RigidTransform(), MotionHypothesis::kOdometry});
}

RigCalibration RigCalibrator::finish(const StageCallback& progress) {
  flush();
  return calibrateFollowedDrive(options_, all_images_, progress, &state_);
}

std::shared_ptr<const SparseMap> RigCalibrator::map() const {
  return mapOfCalibration(options_, state_);
}

RigCalibration calibrateFollowedDrive(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                                      const StageCallback& progress, MappingState* state) {
  return runRigBackEnd(
      options, all_images, progress ? progress : [](const StageProgress&) {}, state);
}

std::shared_ptr<const SparseMap> mapOfCalibration(const RigCalibratorOptions& options,
                                                  const MappingState& state) {
  check(state.vocabulary != nullptr, "mapOfCalibration: expected a calibration that was finished");
  return assembleMap(state.data, state.report.loop_edges, options.features, *state.vocabulary);
}

}  // namespace vcharge
