#include "vcharge_obstacles/obstacle_mapper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_obstacles/map_scan.h"

namespace vcharge {
namespace {

// A stamp this far before the newest means that the drive started over.
constexpr double kReplay_s = 1.0;
// Below this speed the vehicle stands.
constexpr double kStanding_m_per_s = 0.02;
// Stamps that wait for odometry or a camera that may still come; two seconds at 12.5 Hz.
constexpr size_t kMaxWaiting = 25;

}  // namespace

struct ObstacleMapper::Camera {
  size_t index = 0;
  std::unique_ptr<ObstacleDetector> detector;  // of the range maps' camera, which is known with the first one
  std::unique_ptr<GroundWatch> watch;
  MeiCamera::Parameters parameters = MeiCamera::Parameters::Zero();  // of that camera
  cv::Size size;
  std::optional<Timestamp> newest;
  ObstacleCameraStatus status;
};

std::string toString(ObstacleCameraState state) {
  switch (state) {
    case ObstacleCameraState::kNoRangeMaps:
      return "no range maps";
    case ObstacleCameraState::kNoPose:
      return "no pose";
    case ObstacleCameraState::kStanding:
      return "standing";
    case ObstacleCameraState::kHardlySees:
      return "hardly sees";
    case ObstacleCameraState::kGroundLost:
      return "ground lost";
    case ObstacleCameraState::kGroundUnsure:
      return "ground unsure";
    case ObstacleCameraState::kMapping:
      break;
  }
  return "mapping";
}

void ObstacleMapperOptions::validate() const {
  validateInner("detector", detector);
  validateInner("watch", watch);
  validateInner("map", map);
  validateInner("odometry", odometry);
  requireField(max_wait_s >= 0.0, "max_wait_s", "must not be negative", max_wait_s);
  requireField(silent_s > 0.0, "silent_s", "must be positive", silent_s);
  requireField(max_silence_s > 0.0, "max_silence_s", "must be positive", max_silence_s);
  requireField(min_known_share >= 0.0 && min_known_share < 1.0, "min_known_share", "must be in [0, 1)",
               min_known_share);
  requireField(max_step_m > 0.0, "max_step_m", "must be positive", max_step_m);
  requireField(max_step_rad > 0.0, "max_step_rad", "must be positive", max_step_rad);
  requireField(anchor_step_m >= 0.0, "anchor_step_m", "must not be negative", anchor_step_m);
  requireField(anchor_step_rad >= 0.0, "anchor_step_rad", "must not be negative", anchor_step_rad);
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
      throw InputError("rig: cameras." + name + ": vehicle_from_camera is missing: obstacles need it");
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
    // Against going on as before: a car's speed changes little between two messages. How fast it is at first
    // is not known.
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
  emitWhenSilent();  // until now: range maps of the odometry before have had their turn
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
    // How far the vehicle went meanwhile is what the odometry says it is: not to be relied on.
    last_odometry_.reset();
    jump(odometry.stamp);
  }
  watchForJumps(odometry);
  fuseWaiting(false);
}

/// Nothing in the map is where it was: all learn it at once.
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
  if (has_anchor_ && moved.translation().norm() < options_.anchor_step_m &&
      angleOfRotation(moved.rotation()) < options_.anchor_step_rad) {
    // Less than the cells can tell. Translation far from the map's origin stands for small turns, too.
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
    throw InputError("range map of camera '" + map.camera_name + "': not one of the cameras in use");
  }
  const RigCamera& rig_camera = rig_->cameras[camera->index];
  if (!camera->detector || camera->size != map.range_m.size() ||
      camera->parameters != map.camera.parameters()) {
    const WorkingCamera working = rebuildWorkingCamera(map.camera, map.range_m.size(), rig_camera);
    camera->detector =
        std::make_unique<ObstacleDetector>(working, *rig_camera.vehicle_from_camera, options_.detector);
    camera->watch =
        std::make_unique<GroundWatch>(working, *rig_camera.vehicle_from_camera, grid_, options_.watch);
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
  status.known_share = seen.known_share;
  const std::string known = toText(100.0 * seen.known_share, 0) + " % of the pixels have a range";
  if (seen.known_share < options_.min_known_share) {
    status.state = ObstacleCameraState::kHardlySees;
    status.message = "hardly sees: " + known;
  } else if (seen.ground.state == GroundState::kOutOfBounds) {
    status.state = ObstacleCameraState::kGroundLost;
    status.message = "the ground is tilted beyond the bounds: nothing is taken for free";
  } else if (seen.ground.state == GroundState::kFewPoints) {
    status.state = ObstacleCameraState::kGroundUnsure;
    status.message =
        "only " + std::to_string(seen.ground.num_points) + " ground points: nothing is taken for free";
  } else {
    status.state = ObstacleCameraState::kMapping;
    status.message = "mapping: " + known;
  }
}

/// Whether every camera that delivers has come to this stamp. A camera is waited for from when the first one
/// came, however late range maps are by then.
bool ObstacleMapper::isComplete(Timestamp stamp, const Group& group) const {
  const Timestamp heard = group.first_heard.value_or(stamp);
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera || (camera->newest && *camera->newest >= stamp)) {
      continue;
    }
    const bool delivers = !camera->newest || toSeconds(stamp - *camera->newest) < options_.silent_s;
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
    const bool must_go = all || waiting_.size() > kMaxWaiting;  // a camera, or odometry, does not come
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

/// There is no pose for it.
void ObstacleMapper::loseFirstWaiting() {
  const auto first = waiting_.begin();
  for (const auto& [index, look] : first->second.cameras) {
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
  for (auto& [index, look] : group->cameras) {
    CameraObstacles& seen = look.seen;
    if (!look.reference.empty()) {
      seen.changed_share =
          cameras_[index]->watch->compare(stamp, look.reference, seen.ground, fixed_from_vehicle);
    }
    map_.add(seen, grid_, fixed_from_vehicle);
    cameras.push_back(&seen);
  }
  if (!last_emitted_ || stamp > *last_emitted_) {  // else the next map shows what it adds
    emit(map_, cameras);
  }
}

void ObstacleMapper::emit(const LocalObstacleMap& map, const std::vector<const CameraObstacles*>& cameras) {
  ObstacleFrame frame;
  frame.map = map.snapshot();
  frame.map.frame_id = enumNames<FixedFrame>()[static_cast<size_t>(options_.fixed_frame)];
  frame.scan = makeScan(frame.map, options_.map.scan_rays, options_.map.scan_depth_m);
  for (const CameraObstacles* camera : cameras) {
    frame.cameras.push_back(*camera);
  }
  frame.status = status();
  last_emitted_ = frame.map.stamp;
  on_frame_(frame);
}

/// Silence is told by when range maps come, not by their stamps: those that are late are no silence. Who
/// waits for every range map cannot tell the two apart, and hears of the range maps' stamps alone.
void ObstacleMapper::emitWhenSilent() {
  if (!last_odometry_ || !last_emitted_ || !waiting_.empty() || std::isinf(options_.max_wait_s)) {
    return;
  }
  const Timestamp last = last_heard_ ? std::max(*last_heard_, *last_emitted_) : *last_emitted_;
  if (toSeconds(last_odometry_->stamp - last) >= options_.silent_s) {
    emitAt(last_odometry_->stamp);
  }
}

/// What the map would be at a stamp of which there are no range maps (yet). The map itself stays as it is: it
/// depends on the range maps alone, and not on when they come.
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
    all.back().message = stands ? "the vehicle stands: nothing new is seen, the map keeps what it has"
                                : "no range map since " + toString(*camera->newest);
  }
  return all;
}

}  // namespace vcharge
