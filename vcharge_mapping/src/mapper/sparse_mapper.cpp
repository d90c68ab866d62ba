#include "vcharge_mapping/sparse_mapper.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include <tbb/parallel_for.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"

namespace vcharge {

void SparseMapperOptions::validate() const {
  requireField(frame_distance_m >= 0.0, "frame_distance_m", "must not be negative", frame_distance_m);
  requireField(frame_turn_rad >= 0.0, "frame_turn_rad", "must not be negative", frame_turn_rad);
  requireField(keyframe_distance_m > 0.0, "keyframe_distance_m", "must be positive", keyframe_distance_m);
  requireField(keyframe_turn_rad > 0.0, "keyframe_turn_rad", "must be positive", keyframe_turn_rad);
  requireField(max_speed_m_per_s > 0.0, "max_speed_m_per_s", "must be positive", max_speed_m_per_s);
  validateInner("features", features);
  validateInner("tracker", tracker);
  validateInner("ego_motion", ego_motion);
  validateInner("triangulation", triangulation);
  validateInner("loops", loops);
  validateInner("search", search);
  validateInner("bundle", bundle);
}

SparseMapper::SparseMapper(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options)
    : rig_(std::move(rig)), options_(options), extractor_(makeFeatureExtractor(options.features)) {
  options_.validate();
  check(rig_ != nullptr, "SparseMapper: expected a rig");
  if (!rig_->hasExtrinsics()) {
    throw InputError("rig: expected vehicle_from_camera of every camera, which extrinsic calibration gives");
  }
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

SparseMapper::~SparseMapper() = default;

void SparseMapper::processFrame(Timestamp stamp, const std::vector<Image>& images,
                                const RigidTransform& odom_from_vehicle) {
  const StageTimer timer("following", &state_.report.stage_s);
  const RigidTransform odometry_motion = previous_odom_from_vehicle_.inverse() * odom_from_vehicle;
  const double distance_m = odometry_motion.translation().norm();
  const double turn_rad = angleOfRotation(odometry_motion.rotation());
  if (has_previous_ && distance_m < options_.frame_distance_m && turn_rad < options_.frame_turn_rad) {
    ++state_.report.num_standing_frames;
    gatherer_->noteSkipped(stamp, "standing");
    return;
  }
  std::vector<std::vector<RayMatch>> matches_of(trackers_.size());
  tbb::parallel_for(size_t{0}, trackers_.size(), [&](size_t i) {
    trackers_[i].track(images[i], odometry_motion, static_cast<int>(i), &matches_of[i]);
  });
  if (!has_previous_) {
    has_previous_ = true;
    previous_odom_from_vehicle_ = odom_from_vehicle;
    addKeyframe(stamp, odom_from_vehicle, MotionHypothesis::kOdometry);
    return;
  }
  std::vector<RayMatch> matches;
  for (const std::vector<RayMatch>& of_camera : matches_of) {
    matches.insert(matches.end(), of_camera.begin(), of_camera.end());
  }
  const EgoMotion motion = estimateEgoMotion(matches, odometry_motion, options_.ego_motion);
  ++state_.report.num_motions[static_cast<size_t>(motion.hypothesis)];
  auto inlier = motion.is_inlier.begin();
  for (size_t i = 0; i < trackers_.size(); ++i) {
    const auto end = inlier + static_cast<std::ptrdiff_t>(matches_of[i].size());
    trackers_[i].keep(std::vector<bool>(inlier, end));
    inlier = end;
  }
  previous_odom_from_vehicle_ = odom_from_vehicle;
  map_from_previous_ = map_from_previous_ * motion.previous_from_current;
  travelled_m_ += distance_m;
  const Keyframe& last = state_.data.keyframes.back();
  const RigidTransform since = last.map_from_vehicle.inverse() * map_from_previous_;
  if (since.translation().norm() >= options_.keyframe_distance_m ||
      angleOfRotation(since.rotation()) >= options_.keyframe_turn_rad) {
    addKeyframe(stamp, odom_from_vehicle, motion.hypothesis);
  } else {
    state_.frames.push_back(
        {stamp, static_cast<int32_t>(state_.data.keyframes.size()) - 1, since, motion.hypothesis});
  }
}

void SparseMapper::addKeyframe(Timestamp stamp, const RigidTransform& odom_from_vehicle,
                               MotionHypothesis motion) {
  const auto index = static_cast<int32_t>(state_.data.keyframes.size());
  if (index > 0) {
    state_.keyframe_from_next.push_back(state_.data.keyframes.back().map_from_vehicle.inverse() *
                                        map_from_previous_);
  }
  Keyframe keyframe;
  keyframe.stamp = stamp;
  keyframe.odom_from_vehicle = odom_from_vehicle;
  keyframe.map_from_vehicle = map_from_previous_;
  keyframe.travelled_m = travelled_m_;
  keyframe.images.resize(rig_->cameras.size());
  state_.data.keyframes.push_back(std::move(keyframe));
  for (size_t i = 0; i < trackers_.size(); ++i) {
    trackers_[i].addKeyframe(index, static_cast<int32_t>(i), *extractor_, &state_.data);
  }
  state_.frames.push_back({stamp, index, RigidTransform(), motion});
}

std::shared_ptr<const SparseMap> SparseMapper::finish(const StageCallback& progress,
                                                      const CheckpointCallback& checkpoint) {
  gatherer_->finish();
  const SparseMapperReport& report = state_.report;
  if (state_.data.keyframes.size() < 2) {
    std::ostringstream text;
    text << "no map could be made: " << report.num_frames << " frames, " << report.num_frames_without_odometry
         << " without odometry, " << report.num_standing_frames << " standing";
    throw InputError(text.str());
  }
  if (checkpoint && state_.num_finished_stages == 0) {
    checkpoint("following", state_);
  }
  return runBackEnd(
      options_, progress ? progress : [](const StageProgress&) {}, checkpoint, &state_);
}

void SparseMapper::resume(MappingState state) {
  check(gatherer_->isIdle() && state_.frames.empty(),
        "SparseMapper::resume: expected a mapper that was not fed");
  check(state.data.rig != nullptr, "SparseMapper::resume: expected a rig");
  state_ = std::move(state);
  gatherer_->resumeAfter(state_.frames.empty() ? std::nullopt
                                               : std::make_optional(state_.frames.back().stamp));
}

}  // namespace vcharge
