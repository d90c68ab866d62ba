#include "vcharge_reconstruction/frame_follower.h"

#include <utility>

#include <tbb/parallel_for.h>

#include "vcharge_core/base/stage_timer.h"

namespace vcharge {
namespace {

/// A frame that moved by less than both since the previous one is standing: it shows nothing new.
constexpr double kMinFrameDistance_m = 0.05;
constexpr double kMinFrameTurn_rad = 0.01;

}  // namespace

FrameFollower::FrameFollower(const ReconstructionOptions& options,
                             const std::optional<EgoMotionOptions>& ego_motion, ReconstructionState* state,
                             KeyframeCallback on_keyframe)
    : options_(options),
      ego_motion_(ego_motion),
      rig_(state->data.rig),
      state_(state),
      on_keyframe_(std::move(on_keyframe)),
      extractor_(makeFeatureExtractor(options.features)),
      keyframes_(options, state),
      assembler_(rig_->cameras.size(), options.assemblerOptions(),
                 [this](const ImageFrame& frame) { processFrame(frame); }) {
  assembler_.joinStamps(rig_->stamp_tolerance_s);
  state_->report.counters = assembler_.counters();
  for (const RigCamera& camera : rig_->cameras) {
    trackers_.emplace_back(camera, options_.tracker);
  }
}

FrameFollower::~FrameFollower() = default;

void FrameFollower::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  assembler_.addImage(camera_index, stamp, image);
  state_->report.counters = assembler_.counters();
}

void FrameFollower::addOdometry(const VehicleOdometry& odometry) {
  assembler_.addOdometry(odometry);
  state_->report.counters = assembler_.counters();
}

void FrameFollower::flush() {
  assembler_.finish();
}

void FrameFollower::processFrame(const ImageFrame& frame) {
  state_->report.noteFrame(frame, *rig_, assembler_.counters());
  if (!frame.bridged_from_vehicle) {
    return;
  }
  keyframes_.correct(frame.corrections);
  const CorrectedPose* corrected =
      state_->frames.empty() ? nullptr : correctionAt(frame.corrections, state_->frames.back().stamp);
  if (corrected != nullptr) {
    previous_odom_from_vehicle_ = corrected->bridged_from_vehicle;
    if (state_->frames.size() > 1 && state_->frames.back().motion == MotionHypothesis::kOdometry) {
      map_from_vehicle_ = map_from_vehicle_ * corrected->old_vehicle_from_vehicle;
    }
  }
  const Timestamp stamp = frame.stamp;
  const std::vector<Image>& images = frame.images;
  const RigidTransform& odom_from_vehicle = *frame.bridged_from_vehicle;
  const StageTimer timer("following", &state_->report.stage_s);
  const bool is_first = state_->data.keyframes.empty();
  const RigidTransform odometry_motion =
      is_first ? RigidTransform() : previous_odom_from_vehicle_.inverse() * odom_from_vehicle;
  const double distance_m = odometry_motion.translation().norm();
  if (!is_first && distance_m < kMinFrameDistance_m &&
      angleOfRotation(odometry_motion.rotation()) < kMinFrameTurn_rad) {
    ++state_->report.num_standing_frames;
    state_->report.noteSkipped(stamp, "standing");
    return;
  }
  previous_odom_from_vehicle_ = odom_from_vehicle;
  travelled_m_ += distance_m;
  const MatchesByCamera matches = track(images, odometry_motion, frame.motion);
  if (is_first) {
    addKeyframe(frame, RigidTransform(), MotionHypothesis::kOdometry);
    return;
  }
  const Keyframe& last = state_->data.keyframes.back();
  MotionHypothesis motion = MotionHypothesis::kOdometry;
  RigidTransform keyframe_from_vehicle;
  if (ego_motion_) {
    const EgoMotion estimate = estimateMotion(matches, odometry_motion);
    motion = estimate.hypothesis;
    map_from_vehicle_ = map_from_vehicle_ * estimate.previous_from_current;
    keyframe_from_vehicle = last.map_from_vehicle.inverse() * map_from_vehicle_;
  } else {
    keyframe_from_vehicle = last.odom_from_vehicle.inverse() * odom_from_vehicle;
    map_from_vehicle_ = last.map_from_vehicle * keyframe_from_vehicle;
  }
  if (keyframes_.isDue(keyframe_from_vehicle)) {
    addKeyframe(frame, keyframe_from_vehicle, motion);
  } else {
    keyframes_.addFrame(stamp, keyframe_from_vehicle, motion);
  }
}

FrameFollower::MatchesByCamera FrameFollower::track(const std::vector<Image>& images,
                                                    const RigidTransform& odometry_motion,
                                                    const FrameMotion& motion) {
  MatchesByCamera matches(trackers_.size());
  tbb::parallel_for(size_t{0}, trackers_.size(), [&](size_t i) {
    trackers_[i].track(images[i], odometry_motion, motion.of(i), static_cast<int>(i), &matches[i]);
  });
  return matches;
}

EgoMotion FrameFollower::estimateMotion(const MatchesByCamera& matches,
                                        const RigidTransform& odometry_motion) {
  std::vector<RayMatch> all;
  for (const std::vector<RayMatch>& of_camera : matches) {
    all.insert(all.end(), of_camera.begin(), of_camera.end());
  }
  EgoMotion motion = estimateEgoMotion(all, odometry_motion, *ego_motion_);
  ++state_->report.num_motions[static_cast<size_t>(motion.hypothesis)];
  auto inlier = motion.is_inlier.begin();
  for (size_t i = 0; i < trackers_.size(); ++i) {
    const auto end = inlier + static_cast<std::ptrdiff_t>(matches[i].size());
    trackers_[i].keep(std::vector<bool>(inlier, end));
    inlier = end;
  }
  return motion;
}

void FrameFollower::addKeyframe(const ImageFrame& frame, const RigidTransform& keyframe_from_vehicle,
                                MotionHypothesis motion) {
  Keyframe keyframe;
  keyframe.stamp = frame.stamp;
  keyframe.odom_from_vehicle = *frame.bridged_from_vehicle;
  keyframe.motion = frame.motion;
  keyframe.map_from_vehicle = map_from_vehicle_;
  keyframe.travelled_m = travelled_m_;
  const int32_t index = keyframes_.addKeyframe(std::move(keyframe), keyframe_from_vehicle, motion);
  tbb::parallel_for(size_t{0}, trackers_.size(), [&](size_t i) {
    trackers_[i].readKeyframe(index, *extractor_, &state_->data.keyframes[index].images[i]);
  });
  for (size_t i = 0; i < trackers_.size(); ++i) {
    trackers_[i].addKeyframe(index, static_cast<int32_t>(i), &state_->data);
  }
  if (on_keyframe_) {
    on_keyframe_(index, frame.images);
  }
}

}  // namespace vcharge
