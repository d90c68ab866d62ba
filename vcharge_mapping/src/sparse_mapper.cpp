#include "vcharge_mapping/sparse_mapper.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include <tbb/parallel_for.h>

#include "vcharge_core/error.h"
#include "vcharge_core/stage_timer.h"

namespace vcharge {
namespace {

/// Frames that may wait for odometry before they go without.
constexpr size_t kMaxWaitingFrames = 32;
/// An incomplete frame is ready once this many stamps came, itself among them.
constexpr size_t kStampsForIncomplete = 3;

}  // namespace

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
  state_.report.num_missing_images.assign(rig_->cameras.size(), 0);
  for (const RigCamera& camera : rig_->cameras) {
    trackers_.emplace_back(camera, options_.tracker);
  }
}

SparseMapper::~SparseMapper() = default;

void SparseMapper::addOdometry(const VehicleOdometry& odometry) {
  // Counters that start again make the pose jump: the motion over the jump is that of the velocities.
  if (last_raw_odometry_ && odometry.stamp > last_raw_odometry_->stamp) {
    const double period_s = toSeconds(odometry.stamp - last_raw_odometry_->stamp);
    const RigidTransform motion =
        last_raw_odometry_->odom_from_vehicle.inverse() * odometry.odom_from_vehicle;
    if (motion.translation().norm() > options_.max_speed_m_per_s * period_s + 0.1) {
      ++state_.report.num_odometry_resets;
      const RigidTransform likely =
          RigidTransform::planar(last_raw_odometry_->forward_speed_m_per_s * period_s, 0.0,
                                 last_raw_odometry_->yaw_rate_rad_per_s * period_s);
      corrected_from_raw_odom_ = corrected_from_raw_odom_ * last_raw_odometry_->odom_from_vehicle * likely *
                                 odometry.odom_from_vehicle.inverse();
    }
  }
  last_raw_odometry_ = odometry;
  VehicleOdometry corrected = odometry;
  corrected.odom_from_vehicle = corrected_from_raw_odom_ * odometry.odom_from_vehicle;
  odometry_.add(corrected);
  processFrames(false);
}

void SparseMapper::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < rig_->cameras.size(), "SparseMapper::addImage: bad camera");
  if (last_stamp_ && stamp <= *last_stamp_) {
    ++state_.report.num_late_images;
    return;
  }
  PendingFrame& frame = pending_[stamp];
  frame.images.resize(rig_->cameras.size());
  if (frame.images[camera_index].pixels.empty()) {
    frame.images[camera_index] = image;
    ++frame.num_present;
  }
  processFrames(false);
}

void SparseMapper::processFrames(bool all) {
  // A frame is ready once later images have come, or all of its own, and odometry reaches it.
  while (!pending_.empty()) {
    const auto first = pending_.begin();
    const Timestamp stamp = first->first;
    const bool is_complete = first->second.num_present == rig_->cameras.size();
    const auto newest = odometry_.newestStamp();
    const bool has_images = is_complete || pending_.size() >= kStampsForIncomplete;
    const bool has_odometry = newest && *newest >= stamp;
    const bool waited_in_vain = !has_odometry && pending_.size() >= kMaxWaitingFrames;
    if (!all && !(has_images && has_odometry) && !waited_in_vain) {
      return;
    }
    const PendingFrame frame = std::move(first->second);
    pending_.erase(first);
    last_stamp_ = stamp;
    ++state_.report.num_frames;
    if (!is_complete) {
      ++state_.report.num_incomplete_frames;
      noteSkipped(stamp, missingCameras(frame));
    }
    const OdometryBuffer::Lookup lookup = odometry_.lookup(stamp);
    if (!lookup) {
      ++state_.report.num_frames_without_odometry;
      noteSkipped(stamp, describe(lookup.status));
      continue;
    }
    processFrame(stamp, frame, lookup.odometry.odom_from_vehicle);
  }
}

std::string SparseMapper::missingCameras(const PendingFrame& frame) {
  std::string names;
  for (size_t i = 0; i < frame.images.size(); ++i) {
    if (frame.images[i].pixels.empty()) {
      ++state_.report.num_missing_images[i];
      names += (names.empty() ? "without camera " : ", ") + rig_->cameras[i].name;
    }
  }
  return names;
}

void SparseMapper::noteSkipped(Timestamp stamp, const std::string& reason) {
  std::vector<SkippedFrames>& skipped = state_.report.skipped;
  const auto [last, is_new] = last_skipped_.try_emplace(reason);
  if (is_new || last->second.frame + 1 < state_.report.num_frames) {
    last->second.entry = skipped.size();
    skipped.push_back({reason, stamp, stamp, 0});
  }
  last->second.frame = state_.report.num_frames;
  skipped[last->second.entry].last = stamp;
  ++skipped[last->second.entry].num_frames;
}

void SparseMapper::processFrame(Timestamp stamp, const PendingFrame& frame,
                                const RigidTransform& odom_from_vehicle) {
  const StageTimer timer("following", &state_.report.stage_s);
  const RigidTransform odometry_motion = previous_odom_from_vehicle_.inverse() * odom_from_vehicle;
  const double distance_m = odometry_motion.translation().norm();
  const double turn_rad = angleOfRotation(odometry_motion.rotation());
  if (has_previous_ && distance_m < options_.frame_distance_m && turn_rad < options_.frame_turn_rad) {
    ++state_.report.num_standing_frames;
    noteSkipped(stamp, "standing");
    return;
  }
  std::vector<std::vector<RayMatch>> matches_of(trackers_.size());
  tbb::parallel_for(size_t{0}, trackers_.size(), [&](size_t i) {
    trackers_[i].track(frame.images[i], odometry_motion, static_cast<int>(i), &matches_of[i]);
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
  processFrames(true);
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
  check(pending_.empty() && state_.frames.empty(),
        "SparseMapper::resume: expected a mapper that was not fed");
  check(state.data.rig != nullptr, "SparseMapper::resume: expected a rig");
  state_ = std::move(state);
  last_stamp_ = state_.frames.empty() ? std::nullopt : std::make_optional(state_.frames.back().stamp);
}

Trajectory SparseMapper::trajectory() const {
  Trajectory trajectory;
  for (const FramePose& frame : state_.frames) {
    const Keyframe& keyframe = state_.data.keyframes[frame.keyframe];
    RigidTransform keyframe_from_vehicle = frame.keyframe_from_vehicle;
    if (static_cast<size_t>(frame.keyframe) + 1 < state_.data.keyframes.size()) {
      // What adjustment changed between two keyframes, in equal shares of time.
      const Keyframe& next = state_.data.keyframes[frame.keyframe + 1];
      const RigidTransform adjusted = keyframe.map_from_vehicle.inverse() * next.map_from_vehicle;
      const double fraction =
          toSeconds(frame.stamp - keyframe.stamp) / toSeconds(next.stamp - keyframe.stamp);
      const RigidTransform change = adjusted * state_.keyframe_from_next[frame.keyframe].inverse();
      keyframe_from_vehicle = interpolate(RigidTransform(), change, fraction) * keyframe_from_vehicle;
    }
    trajectory.push_back({frame.stamp, keyframe.map_from_vehicle * keyframe_from_vehicle});
  }
  return trajectory;
}

}  // namespace vcharge
