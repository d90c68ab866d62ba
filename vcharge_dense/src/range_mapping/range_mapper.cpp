#include "vcharge_dense/range_mapper.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Images that wait for odometry: two seconds at 12.5 Hz.
constexpr size_t kMaxWaitingImages = 25;
// A stamp this far before the newest one means that a drive is replayed; images that are less late are
// ignored.
constexpr double kReplay_s = 1.0;
// A camera that moved less than this since its last image stands: there is no parallax.
constexpr double kMinMotion_m = 0.03;
// Poses that move faster than this have jumped.
constexpr double kMaxSpeed_m_per_s = 60.0;
// A camera whose newest image is older than this, against the other cameras, has stopped.
constexpr double kMaxImageGap_s = 1.0;

struct Frame {
  SweepImage image;
  double path_m;  // length of the camera's path up to this frame
};

struct WaitingImage {
  Timestamp stamp;
  Image image;
};

}  // namespace

RangeMapperOptions RangeMapperOptions::offline() {
  RangeMapperOptions options;
  options.use_later_images = true;
  options.plane_sweep.aggregation = Aggregation::kReferenceSplit;
  return options;
}

void RangeMapperOptions::usePreset(RangePreset new_preset) {
  preset = new_preset;
  const PlaneSweepOptions default_sweep;
  neighbours.num_neighbours = NeighbourOptions().num_neighbours;
  plane_sweep.num_planes = default_sweep.num_planes;
  plane_sweep.num_ground_planes = default_sweep.num_ground_planes;
  plane_sweep.num_refinement_steps = default_sweep.num_refinement_steps;
  switch (preset) {
    case RangePreset::kFast:
      plane_sweep.num_planes = 40;
      plane_sweep.num_ground_planes = 8;
      plane_sweep.num_refinement_steps = 8;
      break;
    case RangePreset::kDefault:
      break;
    case RangePreset::kAccurate:
      neighbours.num_neighbours = 6;
      plane_sweep.num_planes = 96;
      break;
  }
}

void RangeMapperOptions::fieldWasRead(const char* field) {
  if (std::string_view(field) == "preset") {
    usePreset(preset);
  }
}

void RangeMapperOptions::checkFields() const {
  requireField(!use_later_images || neighbours.num_neighbours % 2 == 0, "neighbours.num_neighbours",
               "must be even where later images are used", neighbours.num_neighbours);
}

struct RangeMapper::Camera {
  size_t index;
  RigidTransform vehicle_from_camera;
  WorkingCamera working_camera;
  PlaneSweep plane_sweep;
  std::deque<WaitingImage> waiting;
  std::deque<Frame> frames;
  size_t next_reference = 0;  // the first frame that was not yet passed on
  std::optional<Timestamp> newest;
  RangeMapperStatus status;
};

RangeMapper::RangeMapper(std::shared_ptr<const CameraRig> rig, const RangeMapperOptions& options,
                         TaskCallback on_task)
    : rig_(std::move(rig)), options_(options), on_task_(std::move(on_task)), poses_(options.odometry) {
  options_.validate();
  cameras_.resize(rig_->cameras.size());
  std::vector<size_t> used;
  for (const std::string& name : options_.cameras) {
    used.push_back(rig_->cameraIndex(name));
  }
  for (size_t i = 0; used.size() < rig_->cameras.size() && options_.cameras.empty(); ++i) {
    used.push_back(i);
  }
  for (const size_t index : used) {
    const RigCamera& camera = rig_->cameras[index];
    if (!camera.vehicle_from_camera) {
      throw InputError("rig: cameras." + camera.name +
                       ": vehicle_from_camera is missing: range maps need it");
    }
    const WorkingCamera working(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask,
                                options_.working_camera);
    std::optional<Plane> ground;
    if (options_.plane_sweep.num_ground_planes > 0) {
      ground = groundInCamera(*camera.vehicle_from_camera);
    }
    cameras_[index].reset(
        new Camera{index,
                   *camera.vehicle_from_camera,
                   working,
                   PlaneSweep(working.model(), working.validMask(), options_.plane_sweep, ground),
                   {},
                   {},
                   0,
                   std::nullopt,
                   {}});
    cameras_[index]->status.camera_name = camera.name;
    cameras_[index]->status.message = "no image yet";
  }
}

RangeMapper::~RangeMapper() = default;

void RangeMapper::setTrajectory(const Trajectory& world_from_vehicle) {
  OdometryBufferOptions buffer_options = options_.odometry;
  buffer_options.history_s = std::numeric_limits<double>::infinity();
  poses_ = OdometryBuffer(buffer_options);
  for (const StampedTransform& stamped : world_from_vehicle) {
    VehicleOdometry odometry;
    odometry.stamp = stamped.stamp;
    odometry.odom_from_vehicle = stamped.world_from_vehicle;
    poses_.add(odometry);
  }
  poses_are_given_ = true;
}

void RangeMapper::restart(Camera* camera, const std::string& reason) {
  camera->waiting.clear();
  camera->frames.clear();
  camera->next_reference = 0;
  camera->newest.reset();
  ++camera->status.resets;
  camera->status.state = RangeMapperState::kFewNeighbours;
  camera->status.message = "restarted: " + reason;
}

void RangeMapper::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < cameras_.size(), "RangeMapper::addImage: unknown camera");
  Camera* camera = cameras_[camera_index].get();
  if (camera == nullptr) {
    return;
  }
  if (camera->newest && stamp <= *camera->newest) {
    if (toSeconds(*camera->newest - stamp) < kReplay_s) {
      ++camera->status.ignored_images;
      return;
    }
    restart(camera, "stamps jumped back");
    newest_image_.reset();
  }
  camera->newest = stamp;
  newest_image_ = newest_image_ ? std::max(*newest_image_, stamp) : stamp;
  ++camera->status.images;
  camera->waiting.push_back({stamp, image});
  processWaiting(camera);
}

void RangeMapper::addOdometry(const VehicleOdometry& odometry) {
  if (poses_are_given_) {
    return;
  }
  const OdometryBuffer::AddResult result = poses_.add(odometry);
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera) {
      continue;
    }
    if (result == OdometryBuffer::AddResult::kAddedAfterGap) {
      processWaiting(camera.get());  // counts images in the gap as without a pose
      // Images before the gap can still be matched with each other, but not with images after it.
      emitReferences(camera.get(), true);
      const std::optional<Timestamp> newest = camera->newest;
      const std::deque<WaitingImage> waiting = camera->waiting;
      restart(camera.get(), "gap in the odometry");
      camera->newest = newest;
      camera->waiting = waiting;
    } else if (result == OdometryBuffer::AddResult::kReset) {
      restart(camera.get(), "stamps of the odometry jumped back");
    }
    processWaiting(camera.get());
  }
}

void RangeMapper::processWaiting(Camera* camera) {
  while (!camera->waiting.empty()) {
    const WaitingImage& first = camera->waiting.front();
    if (!addPosedImage(camera, first.stamp, first.image)) {
      if (camera->waiting.size() <= kMaxWaitingImages) {
        return;
      }
      ++camera->status.without_pose;
    }
    camera->waiting.pop_front();
  }
}

/// Returns false where the pose may still arrive.
bool RangeMapper::addPosedImage(Camera* camera, Timestamp stamp, const Image& image) {
  const OdometryBuffer::Lookup lookup = poses_.lookup(stamp);
  if (!lookup) {
    camera->status.state = RangeMapperState::kNoPose;
    camera->status.message = "no pose at the image stamp " + toString(stamp) + ": " + describe(lookup.status);
    const bool may_come = !poses_are_given_ && (lookup.status == OdometryBuffer::LookupStatus::kEmpty ||
                                                lookup.status == OdometryBuffer::LookupStatus::kAfterLast);
    if (!may_come) {
      ++camera->status.without_pose;
    }
    return !may_come;
  }
  const RigidTransform world_from_camera = lookup.odometry.odom_from_vehicle * camera->vehicle_from_camera;
  if (!camera->frames.empty()) {
    const SweepImage& last = camera->frames.back().image;
    const double motion_m = (world_from_camera.translation() - last.world_from_camera.translation()).norm();
    if (motion_m < kMinMotion_m) {
      ++camera->status.standing;
      camera->status.state = RangeMapperState::kStanding;
      camera->status.message = "the camera does not move: there is no parallax";
      return true;
    }
    if (motion_m > kMaxSpeed_m_per_s * toSeconds(stamp - last.stamp)) {
      emitReferences(camera, true);
      camera->frames.clear();
      camera->next_reference = 0;
      ++camera->status.resets;
    }
  }
  addFrame(camera, {stamp, camera->working_camera.undistort(image.pixels), world_from_camera});
  return true;
}

void RangeMapper::addFrame(Camera* camera, const SweepImage& frame) {
  double path_m = 0.0;
  if (!camera->frames.empty()) {
    const Frame& last = camera->frames.back();
    path_m = last.path_m +
             (frame.world_from_camera.translation() - last.image.world_from_camera.translation()).norm();
  }
  camera->frames.push_back({frame, path_m});
  emitReferences(camera, false);
  // Drops frames that are further back than any baseline of the next reference.
  const double reach_m = 1.5 * options_.neighbours.max_forward_baseline_m;
  const double needed_m =
      (camera->next_reference < camera->frames.size() ? camera->frames[camera->next_reference].path_m
                                                      : path_m) -
      reach_m;
  while (camera->frames.front().path_m < needed_m) {
    camera->frames.pop_front();
    --camera->next_reference;
  }
}

void RangeMapper::emitReferences(Camera* camera, bool drive_is_over) {
  while (camera->next_reference < camera->frames.size()) {
    const double ahead_m = camera->frames.back().path_m - camera->frames[camera->next_reference].path_m;
    if (options_.use_later_images && !drive_is_over && ahead_m < options_.neighbours.max_forward_baseline_m) {
      return;
    }
    emitReference(camera, camera->next_reference);
    ++camera->next_reference;
  }
}

void RangeMapper::emitReference(Camera* camera, size_t index) {
  const SweepImage& reference = camera->frames[index].image;
  const Eigen::Vector3d position = reference.world_from_camera.translation();
  const Eigen::Vector3d axis = reference.world_from_camera.rotation() * Eigen::Vector3d::UnitZ();
  const int sides = options_.use_later_images ? 2 : 1;
  RangeTask task{camera->index, reference, {}};
  for (int side = 0; side < sides; ++side) {
    const size_t first = side == 0 ? 0 : index + 1;
    const size_t last = side == 0 ? index : camera->frames.size();
    if (first == last) {
      continue;
    }
    const Eigen::Vector3d adjacent =
        camera->frames[side == 0 ? index - 1 : index + 1].image.world_from_camera.translation();
    const double longest_m = longestBaseline(options_.neighbours, axis, (adjacent - position).normalized());
    std::vector<double> baselines_m;
    for (size_t i = first; i < last; ++i) {
      baselines_m.push_back((camera->frames[i].image.world_from_camera.translation() - position).norm());
    }
    for (size_t i : selectNeighbours(baselines_m, options_.neighbours.num_neighbours / sides, longest_m)) {
      task.neighbours.push_back(camera->frames[first + i].image);
    }
  }
  if (task.neighbours.empty()) {
    ++camera->status.without_neighbours;
    camera->status.state = RangeMapperState::kFewNeighbours;
    camera->status.message = "no image with enough baseline yet";
    return;
  }
  ++camera->status.references;
  camera->status.state = RangeMapperState::kMapping;
  camera->status.message = "mapping";
  on_task_(std::move(task));
}

void RangeMapper::finish() {
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      camera->status.without_pose += camera->waiting.size();
      camera->waiting.clear();
      emitReferences(camera.get(), true);
    }
  }
}

RangeMap RangeMapper::sweep(const RangeTask& task) const {
  check(task.camera_index < cameras_.size() && cameras_[task.camera_index],
        "RangeMapper::sweep: unknown camera");
  RangeMap map = cameras_[task.camera_index]->plane_sweep.sweep(task.reference, task.neighbours);
  map.camera_name = rig_->cameras[task.camera_index].name;
  map.frame_id = rig_->cameras[task.camera_index].frame_id;
  map.reference = task.reference.pixels;
  return map;
}

std::vector<RangeMapperStatus> RangeMapper::status() const {
  std::vector<RangeMapperStatus> all;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera) {
      continue;
    }
    all.push_back(camera->status);
    if (camera->newest && newest_image_ && toSeconds(*newest_image_ - *camera->newest) > kMaxImageGap_s) {
      all.back().state = RangeMapperState::kNoImages;
      all.back().message = "no image since " + toString(*camera->newest);
    }
  }
  return all;
}

}  // namespace vcharge
