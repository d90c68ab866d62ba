#include "vcharge_obstacles/obstacle_mapper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_obstacles/map_scan.h"

namespace vcharge {
namespace {

// A stamp this much older than the newest one means that the drive started over.
constexpr double kReplay_s = 1.0;
// Below this speed the vehicle stands.
constexpr double kStanding_m_per_s = 0.02;
// Stamps that wait for odometry or a late camera: two seconds at 12.5 Hz.
constexpr size_t kMaxWaiting = 25;
// After this time without any range map a map is emitted all the same, and a camera is no longer waited for.
constexpr double kSilence_s = 0.5;
// Corrections of map -> odom below these bounds are smaller than a cell and not applied. The bound on the
// angle is low because a turn moves cells far from the origin of the map.
constexpr double kMinAnchorStep_m = 0.03;
constexpr double kMinAnchorStep_rad = 0.003;

}  // namespace

struct ObstacleMapper::Camera {
  size_t index = 0;
  std::unique_ptr<ObstacleDetector> detector;  // null before the first range map
  std::unique_ptr<GroundWatch> watch;
  MeiCamera::Parameters parameters = MeiCamera::Parameters::Zero();  // of the range maps' camera
  cv::Size size;
  std::optional<Timestamp> newest;
  ObstacleCameraStatus status;
};

std::string toString(ObstacleCameraState state) {
  constexpr const char* kNames[] = {"no range maps", "no pose",       "standing", "hardly sees",
                                    "ground lost",   "ground unsure", "mapping"};
  return kNames[static_cast<size_t>(state)];
}

ObstacleMapper::ObstacleMapper(std::shared_ptr<const CameraRig> rig, const ObstacleMapperOptions& options,
                               FrameCallback on_frame)
    : rig_(std::move(rig)),
      options_((options.validate(), options)),
      on_frame_(std::move(on_frame)),
      grid_(options.detector.grid),
      poses_(options.odometry),
      map_(options.map) {
  cameras_.resize(rig_->cameras.size());
  std::vector<std::string> names = options_.cameras;
  if (names.empty()) {
    for (const RigCamera& camera : rig_->cameras) {
      names.push_back(camera.name);
    }
  }
  for (const std::string& name : names) {
    const size_t index = rig_->cameraIndex(name);
    if (!rig_->cameras[index].vehicle_from_camera) {
      throw InputError("rig: cameras." + name + ": expected vehicle_from_camera");
    }
    cameras_[index] = std::make_unique<Camera>();
    cameras_[index]->index = index;
    cameras_[index]->status.camera_name = name;
    cameras_[index]->status.message = "no range map yet";
  }
}

ObstacleMapper::~ObstacleMapper() = default;

void ObstacleMapper::startOver() {
  map_ = LocalObstacleMap(options_.map);
  waiting_.clear();
  last_fused_.reset();
  last_emitted_.reset();
  last_heard_.reset();
  last_jump_.reset();
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      camera->newest.reset();
      if (camera->watch) {
        camera->watch->clear();
      }
    }
  }
}

void ObstacleMapper::watchForJumps(const VehicleOdometry& odometry) {
  if (last_odometry_ && odometry.stamp > last_odometry_->stamp) {
    const RigidTransform& from = last_odometry_->odom_from_vehicle;
    const RigidTransform& to = odometry.odom_from_vehicle;
    const double dt = toSeconds(odometry.stamp - last_odometry_->stamp);
    const double turn_rad =
        std::remainder(yawOfRotation(to.rotation()) - yawOfRotation(from.rotation()), 2.0 * M_PI);
    const Eigen::Vector3d step(to.translation().x() - from.translation().x(),
                               to.translation().y() - from.translation().y(), turn_rad);
    // Deviation from constant velocity, which changes little between two messages. The first velocity is
    // unknown.
    const Eigen::Vector3d change =
        last_velocity_ ? Eigen::Vector3d(step - *last_velocity_ * dt) : Eigen::Vector3d::Zero();
    if (dt <= options_.odometry.max_gap_s &&
        (change.head<2>().norm() > options_.max_step_m || std::abs(change.z()) > options_.max_step_rad)) {
      fuseWaiting(true);
      jump(odometry.stamp);
    } else {
      last_velocity_ = step / dt;
    }
  }
  last_odometry_ = odometry;
}

void ObstacleMapper::addOdometry(const VehicleOdometry& odometry) {
  emitWhenSilent();  // range maps of earlier odometry have been added by now
  const OdometryBuffer::AddResult result = poses_.add(odometry);
  if (result == OdometryBuffer::AddResult::kDuplicate || result == OdometryBuffer::AddResult::kOutOfOrder) {
    return;
  }
  if (result == OdometryBuffer::AddResult::kReset) {
    startOver();
    last_odometry_.reset();
    last_velocity_.reset();
    emitAt(odometry.stamp);
  } else if (result == OdometryBuffer::AddResult::kAddedAfterGap) {
    // The motion during the gap is not known reliably.
    last_odometry_.reset();
    jump(odometry.stamp);
  }
  watchForJumps(odometry);
  fuseWaiting(false);
}

/// Empties the map after a jump of the odometry and emits the empty map at once.
void ObstacleMapper::jump(Timestamp stamp) {
  ++num_jumps_;
  startOver();
  last_velocity_.reset();
  last_jump_ = stamp;
  emitAt(stamp);
}

void ObstacleMapper::setMapFromOdom(const RigidTransform& map_from_odom) {
  if (options_.fixed_frame != FixedFrame::kMap) {
    return;
  }
  map_from_odom_ = map_from_odom;
  const RigidTransform moved = map_from_odom * anchor_.inverse();
  if (has_anchor_ && moved.translation().norm() < kMinAnchorStep_m &&
      angleOfRotation(moved.rotation()) < kMinAnchorStep_rad) {
    return;
  }
  map_.reanchor(moved);
  anchor_ = map_from_odom;
  has_anchor_ = true;
}

std::optional<RigidTransform> ObstacleMapper::fixedFromVehicle(Timestamp stamp) const {
  const OdometryBuffer::Lookup lookup = poses_.lookup(stamp);
  if (!lookup || (options_.fixed_frame == FixedFrame::kMap && !has_anchor_)) {
    return std::nullopt;
  }
  return anchor_ * lookup.odometry.odom_from_vehicle;
}

void ObstacleMapper::addRangeMap(const RangeMap& map) {
  const int found = rig_->findCamera(map.camera_name);
  Camera* camera = found < 0 ? nullptr : cameras_[static_cast<size_t>(found)].get();
  if (camera == nullptr) {
    throw InputError("range map of camera '" + map.camera_name + "': expected one of the cameras in use");
  }
  const RigCamera& rig_camera = rig_->cameras[camera->index];
  if (!camera->detector || camera->size != map.range_m.size() ||
      camera->parameters != map.camera.parameters()) {
    const WorkingCamera working = rebuildWorkingCamera(map.camera, map.range_m.size(), rig_camera);
    camera->detector =
        std::make_unique<ObstacleDetector>(working, *rig_camera.vehicle_from_camera, options_.detector);
    camera->watch = std::make_unique<GroundWatch>(working, *rig_camera.vehicle_from_camera, grid_,
                                                  options_.map.free_range_m, options_.watch);
    camera->size = map.range_m.size();
    camera->parameters = map.camera.parameters();
  }
  if (camera->newest && toSeconds(*camera->newest - map.stamp) > kReplay_s) {
    startOver();
  }
  CameraObstacles seen = camera->detector->detect(map);
  updateStatus(camera, seen);
  camera->newest = camera->newest ? std::max(*camera->newest, map.stamp) : map.stamp;
  if ((last_fused_ && map.stamp <= *last_fused_) || (last_jump_ && map.stamp < *last_jump_)) {
    ++camera->status.late;
    return;
  }
  if (last_odometry_) {
    last_heard_ = last_odometry_->stamp;
  }
  Group& group = waiting_.try_emplace(map.stamp, Group{{}, last_heard_}).first->second;
  group.cameras[camera->index] = {std::move(seen), map.reference.clone()};
  fuseWaiting(false);
}

void ObstacleMapper::updateStatus(Camera* camera, const CameraObstacles& seen) const {
  ObstacleCameraStatus& status = camera->status;
  ++status.range_maps;
  status.ground = seen.ground;
  status.known_fraction = seen.known_fraction;
  const std::string known = toText(100.0 * seen.known_fraction, 0) + " % of the pixels have a range";
  if (seen.known_fraction < options_.min_known_fraction) {
    status.state = ObstacleCameraState::kHardlySees;
    status.message = "hardly sees: " + known;
  } else if (seen.ground.state == GroundState::kOutOfBounds) {
    status.state = ObstacleCameraState::kGroundLost;
    status.message = "the ground is tilted beyond the bounds: no cell becomes free";
  } else if (seen.ground.state == GroundState::kFewPoints) {
    status.state = ObstacleCameraState::kGroundUnsure;
    status.message =
        "only " + std::to_string(seen.ground.num_points) + " ground points: no cell becomes free";
  } else {
    status.state = ObstacleCameraState::kMapping;
    status.message = "mapping: " + known;
  }
}

/// Whether every active camera has delivered this stamp, or has been waited for long enough since the first
/// one did.
bool ObstacleMapper::isComplete(Timestamp stamp, const Group& group) const {
  const Timestamp heard = group.first_heard.value_or(stamp);
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera || (camera->newest && *camera->newest >= stamp)) {
      continue;
    }
    const bool delivers = !camera->newest || toSeconds(stamp - *camera->newest) < kSilence_s;
    const bool may_come = !last_odometry_ || toSeconds(last_odometry_->stamp - heard) < options_.max_wait_s;
    if (delivers && may_come) {
      return false;
    }
  }
  return true;
}

void ObstacleMapper::fuseWaiting(bool all) {
  while (!waiting_.empty()) {
    const Timestamp stamp = waiting_.begin()->first;
    const bool must_go = all || waiting_.size() > kMaxWaiting;  // stop waiting for a camera or odometry
    if (!must_go && !isComplete(stamp, waiting_.begin()->second)) {
      return;
    }
    const std::optional<RigidTransform> fixed_from_vehicle = fixedFromVehicle(stamp);
    if (!fixed_from_vehicle) {
      const OdometryBuffer::LookupStatus lookup = poses_.lookup(stamp).status;
      const bool may_come = lookup == OdometryBuffer::LookupStatus::kEmpty ||
                            lookup == OdometryBuffer::LookupStatus::kAfterLast;
      if (may_come && !must_go) {
        return;
      }
    }
    if (!fixed_from_vehicle) {
      loseFirstWaiting();
      continue;
    }
    Group group = std::move(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
    last_fused_ = stamp;
    fuse(stamp, &group, *fixed_from_vehicle);
  }
}

/// Drops the first waiting stamp, for which there is no pose.
void ObstacleMapper::loseFirstWaiting() {
  const auto first = waiting_.begin();
  for (const auto& [index, observation] : first->second.cameras) {
    ObstacleCameraStatus& status = cameras_[index]->status;
    ++status.without_pose;
    status.state = ObstacleCameraState::kNoPose;
    status.message = "no pose at the range map's stamp " + toString(first->first);
  }
  last_fused_ = first->first;
  waiting_.erase(first);
}

void ObstacleMapper::fuse(Timestamp stamp, Group* group, const RigidTransform& fixed_from_vehicle) {
  map_.moveTo(stamp, fixed_from_vehicle);
  std::vector<const CameraObstacles*> cameras;
  for (auto& [index, observation] : group->cameras) {
    CameraObstacles& seen = observation.seen;
    if (!observation.reference.empty()) {
      seen.changed_fraction =
          cameras_[index]->watch->compare(stamp, observation.reference, seen.ground, fixed_from_vehicle);
    }
    map_.add(seen, grid_, fixed_from_vehicle);
    cameras.push_back(&seen);
  }
  if (!last_emitted_ || stamp > *last_emitted_) {  // otherwise the next map shows it
    emit(map_, cameras);
  }
}

void ObstacleMapper::emit(const LocalObstacleMap& map, const std::vector<const CameraObstacles*>& cameras) {
  ObstacleFrame frame;
  frame.map = map.snapshot();
  frame.map.frame_id = enumNames<FixedFrame>()[static_cast<size_t>(options_.fixed_frame)];
  frame.scan = makeScan(frame.map, options_.detector.grid.num_rays);
  for (const CameraObstacles* camera : cameras) {
    frame.cameras.push_back(*camera);
  }
  frame.status = status();
  last_emitted_ = frame.map.stamp;
  on_frame_(frame);
}

/// Silence is measured by the arrival of range maps, not by their stamps, so that a lag is no silence. With
/// an infinite max_wait_s the two cannot be told apart, and maps are emitted at range maps' stamps only.
void ObstacleMapper::emitWhenSilent() {
  if (!last_odometry_ || !last_emitted_ || !waiting_.empty() || std::isinf(options_.max_wait_s)) {
    return;
  }
  const Timestamp last = last_heard_ ? std::max(*last_heard_, *last_emitted_) : *last_emitted_;
  if (toSeconds(last_odometry_->stamp - last) >= kSilence_s) {
    emitAt(last_odometry_->stamp);
  }
}

/// Emits a moved copy of the map at a stamp without range maps. The map itself must not change, so that it
/// depends on the range maps alone and not on when they arrive.
void ObstacleMapper::emitAt(Timestamp stamp) {
  const std::optional<RigidTransform> fixed_from_vehicle = fixedFromVehicle(stamp);
  if (fixed_from_vehicle) {
    LocalObstacleMap moved = map_;
    moved.moveTo(stamp, *fixed_from_vehicle);
    emit(moved, {});
  }
}

void ObstacleMapper::finish() {
  fuseWaiting(true);
}

std::vector<ObstacleCameraStatus> ObstacleMapper::status() const {
  std::vector<ObstacleCameraStatus> all;
  const bool stands =
      last_odometry_ && last_velocity_ && last_velocity_->head<2>().norm() < kStanding_m_per_s;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera) {
      continue;
    }
    all.push_back(camera->status);
    if (!last_odometry_ || !camera->newest ||
        toSeconds(last_odometry_->stamp - *camera->newest) < options_.max_silence_s) {
      continue;
    }
    all.back().state = stands ? ObstacleCameraState::kStanding : ObstacleCameraState::kNoRangeMaps;
    all.back().message = stands ? "the vehicle stands: nothing is measured, the map keeps its state"
                                : "no range map since " + toString(*camera->newest);
  }
  return all;
}

}  // namespace vcharge
