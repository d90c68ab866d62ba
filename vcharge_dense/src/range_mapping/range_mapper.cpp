#include "vcharge_dense/range_mapper.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <utility>

#include "illumination/vehicle_light.h"
#include "range_mapping/extrinsics_noise.h"
#include "range_mapping/inter_camera_stereo.h"
#include "range_mapping/motion_refinement.h"
#include "range_mapping/range_fusion.h"
#include "range_mapping/range_memory.h"
#include "range_mapping/working_images.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/standstill.h"

namespace vcharge {
namespace {

// A camera that has moved less than this since its last image stands still: there is no parallax.
constexpr double kMinMotion_m = 0.03;
// A camera has stopped if its newest image is older than those of other cameras by more than this.
constexpr double kMaxImageGap_s = 1.0;

struct Frame {
  SweepImage image;
  double path_m;                                 // length of the camera's path up to this frame
  std::shared_ptr<const InstantImages> instant;  // null once passed on, or without other cameras
};

}  // namespace

struct RangeMapper::Camera {
  size_t index;
  RigidTransform vehicle_from_camera;
  WorkingCamera working_camera;
  ExposureTimes times;
  PlaneSweep plane_sweep;
  VehicleLight light;
  std::deque<Frame> frames;
  size_t next_reference = 0;  // the first frame that was not yet passed on
  RangeMapperStatus status;
  RangeMemory memory;

  /// Distance from the last frame; infinite without one.
  double motion_m(const RigidTransform& world_from_camera) const {
    return frames.empty()
               ? std::numeric_limits<double>::infinity()
               : (world_from_camera.translation() - frames.back().image.world_from_camera.translation())
                     .norm();
  }
};

RangeMapper::RangeMapper(std::shared_ptr<const CameraRig> rig, const RangeMapperOptions& options,
                         TaskCallback on_task)
    : rig_(std::move(rig)),
      options_(options),
      on_task_(std::move(on_task)),
      condition_(conditionAsCalibrated(*rig_)) {
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
        new Camera{index, *camera.vehicle_from_camera, working, ExposureTimes::of(camera, working),
                   PlaneSweep(working.model(), working.validMask(), options_.plane_sweep, ground),
                   VehicleLight(working.model(), working.validMask(), *camera.vehicle_from_camera)});
    cameras_[index]->status.camera_name = camera.name;
    cameras_[index]->status.message = "no image yet";
  }
  std::vector<bool> is_used;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    is_used.push_back(camera != nullptr);
  }
  if (options_.inter_camera != InterCamera::kOff) {
    std::vector<std::optional<StereoCamera>> views(cameras_.size());
    for (const size_t index : used) {
      views[index] = StereoCamera{cameras_[index]->working_camera, cameras_[index]->vehicle_from_camera};
    }
    stereo_ = std::make_unique<InterCameraStereo>(views, options_.plane_sweep);
  }
  std::vector<std::optional<MotionRefinement::Camera>> followed(cameras_.size());
  for (const size_t index : used) {
    const Camera& camera = *cameras_[index];
    followed[index] = {camera.working_camera.model(), camera.working_camera.validMask(),
                       camera.vehicle_from_camera, camera.times};
  }
  motion_ = std::make_unique<MotionRefinement>(followed, options_.plane_sweep.pose_noise);
  assembler_ = std::make_unique<ImageFrameAssembler>(
      cameras_.size(), options_.frames, [this](const ImageFrame& frame) { process(frame); },
      [this](DriveBreak drive_break, Timestamp /*stamp*/) { startOver(drive_break); }, is_used);
  assembler_->joinStamps(rig_->stamp_tolerance_s);
}

RangeMapper::~RangeMapper() = default;

void RangeMapper::setTrajectory(const Trajectory& world_from_vehicle) {
  assembler_->setTrajectory(world_from_vehicle);
}

void RangeMapper::setCondition(const RigCondition& condition) {
  check(condition.size() == cameras_.size(), "RangeMapper::setCondition: expected one entry per camera");
  condition_ = condition;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      camera->status.has_moved = condition_[camera->index].has_moved;
    }
  }
}

void RangeMapper::startOver(DriveBreak drive_break) {
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      // Images before the break can still be matched with each other, but not with images after it.
      emitReferences(camera.get(), true);
      camera->frames.clear();
      camera->next_reference = 0;
      camera->memory.clear();
      camera->light.clear();
      ++camera->status.resets;
      camera->status.state = RangeMapperState::kFewNeighbours;
      camera->status.message = "started over: " + describe(drive_break);
    }
  }
  motion_->clear();
}

void RangeMapper::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < cameras_.size(), "RangeMapper::addImage: no such camera");
  if (cameras_[camera_index]) {
    ++cameras_[camera_index]->status.images;
    assembler_->addImage(camera_index, stamp, image);
  }
}

void RangeMapper::addOdometry(const VehicleOdometry& odometry) {
  assembler_->addOdometry(odometry);
}

void RangeMapper::process(const ImageFrame& frame) {
  std::vector<const WorkingCamera*> working(cameras_.size(), nullptr);
  std::vector<Exposure> exposures(cameras_.size());
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      working[camera->index] = &camera->working_camera;
      exposures[camera->index] =
          Exposure::of(camera->times, camera->vehicle_from_camera, frame.motion.of(camera->index));
    }
  }
  WorkingImages images(frame, std::move(working), std::move(exposures), condition_, stereo_.get());
  if (frame.odom_from_vehicle) {
    followPoints(frame, &images);
  }
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      correctPoses(camera.get(), frame.corrections);
    }
    if (camera && frame.has_image[camera->index]) {
      addImageWithPose(camera.get(), frame, &images);
    }
  }
}

/// Follows points into the images that become frames, see addImageWithPose().
void RangeMapper::followPoints(const ImageFrame& frame, WorkingImages* images) {
  std::vector<cv::Mat> followed(cameras_.size());
  Timestamp oldest = frame.stamp;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera && frame.has_image[camera->index] && !condition_[camera->index].has_moved &&
        camera->motion_m(*frame.odom_from_vehicle * camera->vehicle_from_camera) >= kMinMotion_m) {
      followed[camera->index] = images->of(camera->index);
    }
    if (camera && !camera->frames.empty()) {
      oldest = std::min(oldest, camera->frames.front().image.stamp);
    }
  }
  motion_->forgetBefore(oldest);
  motion_->addFrame(frame.stamp, followed, *frame.odom_from_vehicle, frame.motion);
}

void RangeMapper::correctPoses(Camera* camera, const std::vector<CorrectedPose>& corrections) {
  for (Frame& earlier : camera->frames) {
    if (const CorrectedPose* corrected = correctionAt(corrections, earlier.image.stamp)) {
      earlier.image.world_from_camera = corrected->odom_from_vehicle * camera->vehicle_from_camera;
    }
  }
}

void RangeMapper::addImageWithPose(Camera* camera, const ImageFrame& frame, WorkingImages* images) {
  if (!frame.odom_from_vehicle) {
    ++camera->status.without_pose;
    camera->status.state = RangeMapperState::kNoPose;
    camera->status.message =
        "no pose at the image's stamp " + toString(frame.stamp) + ": " + describe(frame.odometry_status);
    return;
  }
  const Timestamp stamp = frame.stamp;
  SweepImage image{stamp,   {}, *frame.odom_from_vehicle * camera->vehicle_from_camera,
                   nullptr, {}, images->exposureOf(camera->index)};
  if (!camera->frames.empty()) {
    const SweepImage& last = camera->frames.back().image;
    const double motion_m = camera->motion_m(image.world_from_camera);
    if (motion_m < kMinMotion_m) {
      ++camera->status.standing;
      camera->status.state = RangeMapperState::kStanding;
      camera->status.message = "the camera does not move: there is no parallax";
      // Whoever fuses range maps counts on motion stereo where the vehicle does not stand, see standsAt().
      std::shared_ptr<const InstantImages> instant =
          standsAt(assembler_->odometry(), stamp) ? images->instant(camera->index) : nullptr;
      if (instant) {
        camera->status.message = "the camera does not move: ranges only where other cameras see the same";
        image.pixels = images->of(camera->index);
        emit(camera, {camera->index, image, {}, instant});
      }
      return;
    }
    // The assembler detects jumps of the odometry; jumps of a given trajectory are detected here.
    if (motion_m > options_.frames.max_speed_m_per_s * toSeconds(stamp - last.stamp)) {
      emitReferences(camera, true);
      camera->frames.clear();
      camera->next_reference = 0;
      ++camera->status.resets;
    }
  }
  image.pixels = camera->light.removeFrom(images->of(camera->index), image.world_from_camera);
  addFrame(camera, image, images->instant(camera->index));
}

void RangeMapper::addFrame(Camera* camera, const SweepImage& frame,
                           std::shared_ptr<const InstantImages> instant) {
  double path_m = 0.0;
  if (!camera->frames.empty()) {
    const Frame& last = camera->frames.back();
    path_m = last.path_m +
             (frame.world_from_camera.translation() - last.image.world_from_camera.translation()).norm();
  }
  camera->frames.push_back({frame, path_m, std::move(instant)});
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
  RangeTask task{camera->index, reference, {}, std::move(camera->frames[index].instant)};
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
      task.neighbours.push_back(refined(*camera, camera->frames[first + i].image, reference));
    }
  }
  if (task.neighbours.empty()) {
    ++camera->status.without_neighbours;
    camera->status.state = RangeMapperState::kFewNeighbours;
    camera->status.message = "no image with enough baseline yet";
    if (task.instant && standsAt(assembler_->odometry(), reference.stamp)) {
      emit(camera, std::move(task));
    }
    return;
  }
  if (options_.inter_camera != InterCamera::kAlways) {
    task.instant.reset();
  }
  camera->status.state = RangeMapperState::kMapping;
  camera->status.message = "mapping";
  emit(camera, std::move(task));
}

SweepImage RangeMapper::refined(const Camera& camera, const SweepImage& neighbour,
                                const SweepImage& reference) {
  SweepImage result = motion_->refined(neighbour, reference, camera.vehicle_from_camera);
  addNoiseOfExtrinsics(condition_[camera.index],
                       result.world_from_camera.inverse() * reference.world_from_camera, &result.noise);
  return result;
}

void RangeMapper::emit(Camera* camera, RangeTask task) {
  ++camera->status.references;
  camera->status.inter_camera += task.instant ? 1 : 0;
  on_task_(std::move(task));
}

void RangeMapper::finish() {
  assembler_->finish();
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      emitReferences(camera.get(), true);
    }
  }
}

RangeMap RangeMapper::sweepMotion(const RangeTask& task) const {
  Camera& camera = *cameras_[task.camera_index];
  if (!options_.remember) {
    return camera.plane_sweep.sweep(task.reference, task.neighbours);
  }
  const std::optional<RememberedRanges> last = camera.memory.before(task.reference.stamp);
  RangeMap map = camera.plane_sweep.sweep(task.reference, task.neighbours, nullptr, last ? &*last : nullptr);
  camera.memory.keep(map, task.reference.world_from_camera);
  return map;
}

RangeMap RangeMapper::sweep(const RangeTask& task) const {
  check(task.camera_index < cameras_.size() && cameras_[task.camera_index],
        "RangeMapper::sweep: unknown camera");
  std::optional<RangeMap> from_cameras;
  if (task.instant) {
    check(stereo_ != nullptr, "RangeMapper::sweep: a task of another mapper");
    from_cameras = stereo_->rangeMap(*task.instant, task.camera_index);
  }
  RangeMap map = from_cameras && task.neighbours.empty() ? *from_cameras : sweepMotion(task);
  if (from_cameras && !task.neighbours.empty()) {
    map = fuseRangeMaps(map, *from_cameras);
  }
  map.camera_name = rig_->cameras[task.camera_index].name;
  map.frame_id = rig_->cameras[task.camera_index].frame_id;
  if (map.reference.empty()) {
    map.reference = task.reference.pixels;
  }
  return map;
}

std::vector<RangeMapperStatus> RangeMapper::status() const {
  std::vector<RangeMapperStatus> all;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (!camera) {
      continue;
    }
    RangeMapperStatus status = camera->status;
    status.ignored_images = static_cast<uint64_t>(assembler_->counters().late_images[camera->index]);
    const std::optional<Timestamp> newest = assembler_->newestImage(camera->index);
    const std::optional<Timestamp> lacking = assembler_->lacksOdometryAt();
    if (newest && toSeconds(*assembler_->newestImage() - *newest) > kMaxImageGap_s) {
      status.state = RangeMapperState::kNoImages;
      status.message = "no image since " + toString(*newest);
    } else if (newest && lacking) {
      status.state = RangeMapperState::kNoPose;
      status.message = "no odometry yet at the image's stamp " + toString(*lacking);
    }
    all.push_back(status);
  }
  return all;
}

}  // namespace vcharge
