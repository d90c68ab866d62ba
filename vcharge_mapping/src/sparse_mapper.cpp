#include "vcharge_mapping/sparse_mapper.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include <tbb/parallel_for.h>

#include "map_assembly.h"
#include "vcharge_core/error.h"

namespace vcharge {
namespace {

/// Wall time of a stage, reported where it ends.
class StageTimer {
 public:
  StageTimer(std::string name, std::map<std::string, double>* times)
      : name_(std::move(name)), times_(times) {}
  ~StageTimer() {
    (*times_)[name_] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  const std::string name_;
  std::map<std::string, double>* times_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

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
  data_.rig = rig_;
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
      ++report_.num_odometry_resets;
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
  if (!data_.keyframes.empty() && stamp <= frames_.back().stamp) {
    return;  // late
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
    ++report_.num_frames;
    report_.num_incomplete_frames += is_complete ? 0 : 1;
    const OdometryBuffer::Lookup lookup = odometry_.lookup(stamp);
    if (!lookup) {
      ++report_.num_frames_without_odometry;
      continue;
    }
    processFrame(stamp, frame, lookup.odometry.odom_from_vehicle);
  }
}

void SparseMapper::processFrame(Timestamp stamp, const PendingFrame& frame,
                                const RigidTransform& odom_from_vehicle) {
  const StageTimer timer("following", &report_.stage_s);
  const RigidTransform odometry_motion = previous_odom_from_vehicle_.inverse() * odom_from_vehicle;
  const double distance_m = odometry_motion.translation().norm();
  const double turn_rad = angleOfRotation(odometry_motion.rotation());
  if (has_previous_ && distance_m < options_.frame_distance_m && turn_rad < options_.frame_turn_rad) {
    ++report_.num_standing_frames;
    return;
  }
  std::vector<std::vector<RayMatch>> matches_of(trackers_.size());
  tbb::parallel_for(size_t{0}, trackers_.size(), [&](size_t i) {
    trackers_[i].track(frame.images[i], odometry_motion, static_cast<int>(i), &matches_of[i]);
  });
  if (!has_previous_) {
    has_previous_ = true;
    previous_odom_from_vehicle_ = odom_from_vehicle;
    addKeyframe(stamp, odom_from_vehicle);
    return;
  }
  std::vector<RayMatch> matches;
  for (const std::vector<RayMatch>& of_camera : matches_of) {
    matches.insert(matches.end(), of_camera.begin(), of_camera.end());
  }
  const EgoMotion motion = estimateEgoMotion(matches, odometry_motion, options_.ego_motion);
  ++report_.num_motions[static_cast<size_t>(motion.hypothesis)];
  auto inlier = motion.is_inlier.begin();
  for (size_t i = 0; i < trackers_.size(); ++i) {
    const auto end = inlier + static_cast<std::ptrdiff_t>(matches_of[i].size());
    trackers_[i].keep(std::vector<bool>(inlier, end));
    inlier = end;
  }
  previous_odom_from_vehicle_ = odom_from_vehicle;
  map_from_previous_ = map_from_previous_ * motion.previous_from_current;
  travelled_m_ += distance_m;
  const Keyframe& last = data_.keyframes.back();
  const RigidTransform since = last.map_from_vehicle.inverse() * map_from_previous_;
  if (since.translation().norm() >= options_.keyframe_distance_m ||
      angleOfRotation(since.rotation()) >= options_.keyframe_turn_rad) {
    addKeyframe(stamp, odom_from_vehicle);
  } else {
    frames_.push_back({stamp, static_cast<int32_t>(data_.keyframes.size()) - 1, since});
  }
}

void SparseMapper::addKeyframe(Timestamp stamp, const RigidTransform& odom_from_vehicle) {
  const auto index = static_cast<int32_t>(data_.keyframes.size());
  if (index > 0) {
    keyframe_from_next_.push_back(data_.keyframes.back().map_from_vehicle.inverse() * map_from_previous_);
  }
  Keyframe keyframe;
  keyframe.stamp = stamp;
  keyframe.odom_from_vehicle = odom_from_vehicle;
  keyframe.map_from_vehicle = map_from_previous_;
  keyframe.travelled_m = travelled_m_;
  keyframe.images.resize(rig_->cameras.size());
  data_.keyframes.push_back(std::move(keyframe));
  for (size_t i = 0; i < trackers_.size(); ++i) {
    trackers_[i].addKeyframe(index, static_cast<int32_t>(i), *extractor_, &data_);
  }
  frames_.push_back({stamp, index, RigidTransform()});
}

std::shared_ptr<const SparseMap> SparseMapper::finish(const Progress& progress) {
  processFrames(true);
  if (data_.keyframes.size() < 2) {
    std::ostringstream text;
    text << "no map could be made: " << report_.num_frames << " frames, "
         << report_.num_frames_without_odometry << " without odometry, " << report_.num_standing_frames
         << " standing";
    throw InputError(text.str());
  }
  const auto stage = [&](const char* name, const auto& work) {
    progress(name, 0.0);
    const StageTimer timer(name, &report_.stage_s);
    work();
    progress(name, 1.0);
  };
  BundleAdjustmentSummary bundle;
  stage("first adjustment", [&] {
    // Chained motions bend: rays may miss their point by much more than they will in the end.
    TriangulationOptions lenient = options_.triangulation;
    lenient.max_error_rad = options_.first_max_error_rad;
    BundleAdjustmentOptions lenient_bundle = options_.bundle;
    lenient_bundle.outlier_sigmas = INFINITY;
    triangulateTracks(lenient, &data_);
    adjustBundle(lenient_bundle, &data_);
    triangulateTracks(options_.triangulation, &data_);
    bundle = adjustBundle(options_.bundle, &data_);
  });
  std::shared_ptr<const VocabularyTree> vocabulary;
  stage("vocabulary", [&] { vocabulary = trainVocabulary(options_.loops, data_); });
  stage("loops", [&] {
    report_.loop_edges =
        findLoops(options_.loops, vocabulary, data_, [&](double fraction) { progress("loops", fraction); });
  });
  stage("pose graph", [&] {
    closeLoops(options_.loops, &report_.loop_edges, &data_);
    triangulateTracks(options_.triangulation, &data_);
  });
  for (int round = 0; round < 2; ++round) {
    stage("landmark search", [&] { searchLandmarks(options_.search, &data_); });
    stage("last adjustment", [&] { bundle = adjustBundle(options_.bundle, &data_); });
  }
  report_.num_observations = bundle.num_observations;
  report_.rms_px = bundle.rms_px;
  for (const Track& track : data_.tracks) {
    report_.num_landmarks += track.position_m ? 1 : 0;
  }
  if (report_.num_landmarks == 0) {
    throw InputError("no map could be made: no point of the scene was seen from enough places");
  }
  std::shared_ptr<const SparseMap> map;
  stage("assembly", [&] { map = assembleMap(data_, report_.loop_edges, options_.features, *vocabulary); });
  return map;
}

Trajectory SparseMapper::trajectory() const {
  Trajectory trajectory;
  for (const FramePose& frame : frames_) {
    const Keyframe& keyframe = data_.keyframes[frame.keyframe];
    RigidTransform keyframe_from_vehicle = frame.keyframe_from_vehicle;
    if (static_cast<size_t>(frame.keyframe) + 1 < data_.keyframes.size()) {
      // What adjustment changed between two keyframes, in equal shares of time.
      const Keyframe& next = data_.keyframes[frame.keyframe + 1];
      const RigidTransform adjusted = keyframe.map_from_vehicle.inverse() * next.map_from_vehicle;
      const double fraction =
          toSeconds(frame.stamp - keyframe.stamp) / toSeconds(next.stamp - keyframe.stamp);
      const RigidTransform change = adjusted * keyframe_from_next_[frame.keyframe].inverse();
      keyframe_from_vehicle = interpolate(RigidTransform(), change, fraction) * keyframe_from_vehicle;
    }
    trajectory.push_back({frame.stamp, keyframe.map_from_vehicle * keyframe_from_vehicle});
  }
  return trajectory;
}

}  // namespace vcharge
