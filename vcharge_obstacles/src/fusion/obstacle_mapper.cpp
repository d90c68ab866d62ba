#include "vcharge_obstacles/obstacle_mapper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "corridor/path_curvature.h"
#include "fusion/ground_evidence.h"
#include "fusion/hidden_ground.h"
#include "ground/standing_watch.h"
#include "liveness/silent_cameras.h"
#include "occupancy/object_cells.h"
#include "steps/near_heights.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/frames/standstill.h"
#include "vcharge_obstacles/map_scan.h"

namespace vcharge {
namespace {

// If no range map arrives for this time, a map is emitted nevertheless.
constexpr double kSilence_s = 0.5;
// After this time without range maps, the map of a camera's silence does not wait for the next ones.
constexpr double kNoRangeMaps_s = 0.2;
// Corrections of map -> odom below these bounds are smaller than a cell and are ignored. The bound on the
// angle is low because a turn moves cells far from the origin of the map.
constexpr double kMinAnchorStep_m = 0.03;
constexpr double kMinAnchorStep_rad = 0.003;

}  // namespace

struct ObstacleMapper::Camera {
  size_t index = 0;
  std::unique_ptr<ObstacleDetector> detector;  // null before the first range map
  std::unique_ptr<GroundWatch> watch;
  std::unique_ptr<NearHeights> heights;
  MeiCamera::Parameters parameters = MeiCamera::Parameters::Zero();  // camera of the range maps
  cv::Size size;
  ObstacleCameraStatus status;
};

std::string toString(ObstacleCameraState state) {
  constexpr const char* kNames[] = {"no range maps", "silent",      "frozen",        "no pose", "standing",
                                    "hardly sees",   "ground lost", "ground unsure", "mapping"};
  return kNames[static_cast<size_t>(state)];
}

ObstacleMapper::ObstacleMapper(std::shared_ptr<const CameraRig> rig, const ObstacleMapperOptions& options,
                               FrameCallback on_frame)
    : rig_(std::move(rig)),
      options_((options.validate(), options)),
      on_frame_(std::move(on_frame)),
      grid_(options.detector.grid),
      map_(options.map),
      steps_(options.vehicle.outline(), options.steps),
      corridor_finder_(options.vehicle.outline(), options.corridor),
      gap_finder_(options.vehicle),
      curvature_(std::make_unique<PathCurvature>()) {
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
  std::vector<bool> is_used;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    is_used.push_back(camera != nullptr);
  }
  assembler_ = std::make_unique<FrameAssembler<Observation>>(
      cameras_.size(), options_.frames, [this](Frame frame) { process(std::move(frame)); },
      [this](DriveBreak drive_break, Timestamp stamp) { startOver(drive_break, stamp); }, is_used);
  hidden_ = std::make_unique<const HiddenGround>(*rig_, is_used, options_.vehicle.outline());
  silent_ = std::make_unique<SilentCameras>(rig_, is_used, options_.map.free_range_m);
  standing_ = std::make_unique<StandingWatch>(rig_, grid_, options_.map.free_range_m, options_.watch);
  // Range maps take long to compute: a replay must give the same map however long that is.
  assembler_->ignoreCorrections();
}

ObstacleMapper::~ObstacleMapper() = default;

/// Clears the map after a jump, because its cells have lost their positions, and emits it at once.
void ObstacleMapper::startOver(DriveBreak drive_break, Timestamp stamp) {
  num_jumps_ += drive_break == DriveBreak::kReplay ? 0 : 1;
  map_ = LocalObstacleMap(options_.map);
  steps_ = StepMapper(options_.vehicle.outline(), options_.steps);
  curvature_->clear();
  standing_->clear();
  objects_.clear();
  last_fused_.reset();
  if (drive_break == DriveBreak::kReplay) {
    silent_->clear();
  } else {
    silent_->noteJump();
  }
  last_emitted_.reset();
  last_heard_.reset();
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera && camera->watch) {
      camera->watch->clear();
    }
  }
  emitAt(stamp);
}

void ObstacleMapper::addOdometry(const VehicleOdometry& odometry) {
  emitWhenSilent();  // range maps of earlier odometry have been added by now
  assembler_->addOdometry(odometry);
  settleImages(odometry.stamp);
}

void ObstacleMapper::noteImage(size_t camera_index, Timestamp stamp, uint64_t fingerprint) {
  check(camera_index < cameras_.size(), "ObstacleMapper::noteImage: expected a camera of the rig");
  const std::optional<VehicleOdometry>& odometry = assembler_->odometry().last();
  silent_->addImage(camera_index, stamp, fingerprint,
                    odometry ? std::optional<Timestamp>(odometry->stamp) : std::nullopt);
}

void ObstacleMapper::addImage(size_t camera_index, Timestamp stamp, uint64_t fingerprint,
                              const std::function<cv::Mat()>& pixels) {
  noteImage(camera_index, stamp, fingerprint);
  standing_->addImage(camera_index, stamp, pixels);
}

std::optional<RigidTransform> ObstacleMapper::odomFromVehicle(Timestamp stamp) const {
  const OdometryBuffer::Lookup pose = assembler_->odometry().lookup(stamp);
  return pose ? std::optional<RigidTransform>(pose.odometry.odom_from_vehicle) : std::nullopt;
}

/// Judges the images that the odometry has reached.
void ObstacleMapper::settleImages(Timestamp until) {
  silent_->settle(until, [this](Timestamp stamp) { return odomFromVehicle(stamp); });
  standing_->settle(until, [this](Timestamp stamp) {
    const OdometryBuffer::Lookup found = assembler_->odometry().lookup(stamp);
    return found ? std::optional<VehicleOdometry>(found.odometry) : std::nullopt;
  });
}

void ObstacleMapper::forgetUnwatched(Timestamp stamp, LocalObstacleMap* map) const {
  silent_->forgetUnwatched(last_fused_.value_or(Timestamp()), stamp, map);
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
  steps_.reanchor(moved);
  anchor_ = map_from_odom;
  has_anchor_ = true;
}

void ObstacleMapper::setObjects(Timestamp stamp, std::vector<TrackedObject> objects) {
  objects_stamp_ = stamp;
  objects_ = std::move(objects);
}

std::optional<RigidTransform> ObstacleMapper::fixedFromVehicle(
    const std::optional<RigidTransform>& odom_from_vehicle) const {
  if (!odom_from_vehicle || (options_.fixed_frame == FixedFrame::kMap && !has_anchor_)) {
    return std::nullopt;
  }
  return anchor_ * *odom_from_vehicle;
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
    camera->detector = std::make_unique<ObstacleDetector>(working, *rig_camera.vehicle_from_camera,
                                                          options_.vehicle.outline(), options_.detector);
    camera->watch = std::make_unique<GroundWatch>(working, *rig_camera.vehicle_from_camera, grid_,
                                                  options_.map.free_range_m, options_.watch);
    camera->heights = std::make_unique<NearHeights>(working, *rig_camera.vehicle_from_camera,
                                                    options_.vehicle.outline(), StepMapper::kReach_m);
    standing_->setCamera(camera->index, working);
    camera->size = map.range_m.size();
    camera->parameters = map.camera.parameters();
  }
  CameraObstacles obstacles = camera->detector->detect(map);
  updateStatus(camera, obstacles);
  HeightPoints heights = camera->heights->find(map, obstacles.ground);
  const std::optional<VehicleOdometry> odometry = assembler_->odometry().last();
  if (assembler_->addImage(camera->index, map.stamp,
                           {std::move(obstacles), std::move(heights), map.reference.clone()}) &&
      odometry) {
    last_heard_ = odometry->stamp;
  }
}

void ObstacleMapper::expectRangeMaps(Timestamp stamp, std::vector<bool> cameras) {
  assembler_->expect(stamp, std::move(cameras));
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

void ObstacleMapper::process(Frame frame) {
  if (const std::optional<RigidTransform> fixed_from_vehicle = fixedFromVehicle(frame.odom_from_vehicle)) {
    fuse(&frame, *fixed_from_vehicle);
  } else {
    noteWithoutPose(frame);
  }
}

void ObstacleMapper::noteWithoutPose(const Frame& frame) {
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera && frame.has_image[camera->index]) {
      ++camera->status.without_pose;
      camera->status.state = ObstacleCameraState::kNoPose;
      camera->status.message = "no pose at the range map's stamp " + toString(frame.stamp);
    }
  }
}

void ObstacleMapper::moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle,
                            LocalObstacleMap* map) const {
  // A camera that was silent has seen the ground around the earlier pose and around this one.
  forgetUnwatched(stamp, map);
  map->moveTo(stamp, fixed_from_vehicle,
              [this](const Eigen::Vector2d& point_m) { return hidden_->contains(point_m); });
  forgetUnwatched(stamp, map);
}

void ObstacleMapper::fuse(Frame* frame, const RigidTransform& fixed_from_vehicle) {
  settleImages(frame->stamp);
  is_at_rest_ = standsAt(assembler_->odometry(), frame->stamp);
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera && frame->has_image[camera->index]) {
      silent_->addRangeMap(camera->index, frame->stamp);
    }
  }
  moveTo(frame->stamp, fixed_from_vehicle, &map_);
  steps_.moveTo(frame->stamp, fixed_from_vehicle);
  standing_->apply(frame->stamp, anchor_, &map_);
  standing_->dropChanges(frame->stamp);
  last_fused_ = frame->stamp;
  std::vector<const CameraObstacles*> cameras;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera || !frame->has_image[camera->index] ||
        silent_->liveness(camera->index).isRepeated(frame->stamp)) {
      continue;
    }
    auto& [obstacles, heights, reference] = frame->images[camera->index];
    if (!reference.empty()) {
      addAppearance(camera->watch->compare(frame->stamp, reference, obstacles.ground, fixed_from_vehicle),
                    grid_, &obstacles);
    }
    map_.add(obstacles, grid_, fixed_from_vehicle, is_at_rest_);
    steps_.add(is_at_rest_ ? HeightPoints() : heights);  // errors repeat at rest
    cameras.push_back(&obstacles);
  }
  if (!last_emitted_ || frame->stamp > *last_emitted_) {  // otherwise the next map includes it
    emit(map_, steps_, cameras);
  }
}

void ObstacleMapper::emit(const LocalObstacleMap& map, const StepMapper& steps,
                          const std::vector<const CameraObstacles*>& cameras) {
  ObstacleFrame frame;
  frame.map = map.snapshot();
  frame.map.frame_id = enumNames<FixedFrame>()[static_cast<size_t>(options_.fixed_frame)];
  frame.steps = steps.snapshot();
  frame.steps.frame_id = frame.map.frame_id;
  const std::vector<TrackedObject> objects =
      transformed(anchor_, movedObjects(objects_, toSeconds(frame.map.stamp - objects_stamp_)));
  forgetFreeUnder(objects, &frame.map);
  frame.scan = makeScan(frame.map, options_.detector.grid.num_rays);
  const double curvature_per_m =
      curvature_->update(frame.map.stamp, [this](Timestamp stamp) { return odomFromVehicle(stamp); });
  frame.corridor = corridor_finder_.find(frame.map, curvature_per_m, objects);
  frame.gaps = gap_finder_.find(frame.map);
  std::for_each(cameras.begin(), cameras.end(),
                [&](const auto* camera) { frame.cameras.push_back(*camera); });
  frame.status = status();
  last_emitted_ = frame.map.stamp;
  num_silent_emitted_ = silent_->numSilentAt(frame.map.stamp);
  on_frame_(frame);
}

/// Emits the map while no range maps arrive. The time is measured by their arrival instead of their
/// stamps, so that a delay is no interruption. A stage that waits for everything cannot distinguish them, and
/// emits maps only at the stamps of range maps.
void ObstacleMapper::emitWhenSilent() {
  const std::optional<VehicleOdometry>& odometry = assembler_->odometry().last();
  if (!odometry || !last_emitted_ || numWaiting() > 0 || options_.frames.waitsForEverything()) {
    return;
  }
  const Timestamp last = last_heard_ ? std::max(*last_heard_, *last_emitted_) : *last_emitted_;
  const bool is_newly_silent = silent_->numSilentAt(odometry->stamp) > num_silent_emitted_ &&
                               odometry->stamp > *last_emitted_ &&
                               (!last_heard_ || toSeconds(odometry->stamp - *last_heard_) >= kNoRangeMaps_s);
  if (is_newly_silent || toSeconds(odometry->stamp - last) >= kSilence_s) {
    emitAt(odometry->stamp);
  }
}

/// Emits a moved copy of the map at a stamp without range maps. The map itself must not change, so that it
/// depends only on the range maps and not on when they arrive.
void ObstacleMapper::emitAt(Timestamp stamp) {
  if (const std::optional<RigidTransform> fixed_from_vehicle = fixedFromVehicle(odomFromVehicle(stamp))) {
    LocalObstacleMap moved = map_;
    moveTo(stamp, *fixed_from_vehicle, &moved);
    standing_->apply(stamp, anchor_, &moved);
    StepMapper moved_steps = steps_;
    moved_steps.moveTo(stamp, *fixed_from_vehicle);
    emit(moved, moved_steps, {});
  }
}

void ObstacleMapper::finish() {
  assembler_->finish();
}

std::vector<ObstacleCameraStatus> ObstacleMapper::status() const {
  std::vector<ObstacleCameraStatus> all;
  const DriveOdometry& odometry = assembler_->odometry();
  const bool stands = odometry.last() && standsAt(odometry, odometry.last()->stamp);
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera) {
      continue;
    }
    ObstacleCameraStatus status = camera->status;
    if (is_at_rest_ && status.state > ObstacleCameraState::kStanding) {  // its range map was used
      status.state = ObstacleCameraState::kStanding;
      status.message = "the vehicle stands: only the overlap of cameras is measured";
    }
    status.late = static_cast<uint64_t>(assembler_->counters().late_images[camera->index]);
    const std::optional<Timestamp> newest = assembler_->newestImage(camera->index);
    if (odometry.last() && newest && toSeconds(odometry.last()->stamp - *newest) >= options_.max_silence_s) {
      status.state = stands ? ObstacleCameraState::kStanding : ObstacleCameraState::kNoRangeMaps;
      status.message = stands ? "the vehicle stands: nothing is measured, the map keeps its state"
                              : "no range map since " + toString(*newest);
    }
    setLiveness(*camera, &status);
    all.push_back(status);
  }
  return all;
}

void ObstacleMapper::setLiveness(const Camera& camera, ObstacleCameraStatus* status) const {
  const CameraLiveness& liveness = silent_->liveness(camera.index);
  const std::optional<VehicleOdometry>& odometry = assembler_->odometry().last();
  const CameraLiveness::State state =
      odometry ? liveness.stateAt(odometry->stamp) : CameraLiveness::State::kUnknown;
  if (state == CameraLiveness::State::kSilent || state == CameraLiveness::State::kFrozen) {
    const bool is_silent = state == CameraLiveness::State::kSilent;
    status->state = is_silent ? ObstacleCameraState::kSilent : ObstacleCameraState::kFrozen;
    status->message = (is_silent ? "no image since " : "the images repeat the one of ") +
                      toString(*liveness.lastNew()) + ": ground that no other camera sees is not free";
  }
  status->image_lag_s = silent_->imageLag_s(camera.index);
  if (status->image_lag_s >= kLateImages_s) {
    status->message += "; images come " + toText(status->image_lag_s, 2) + " s after their stamps";
  }
}

}  // namespace vcharge
