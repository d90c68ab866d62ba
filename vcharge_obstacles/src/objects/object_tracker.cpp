#include "vcharge_obstacles/object_tracker.h"

#include <algorithm>
#include <utility>

#include "bodies/person_likeness.h"
#include "light/mirror_evidence.h"
#include "objects/freestanding.h"
#include "objects/object_camera.h"
#include "objects/object_detections.h"
#include "objects/object_filter.h"
#include "objects/object_following.h"
#include "objects/pose_history.h"
#include "occupancy/known_obstacles.h"
#include "points/followed_points.h"
#include "points/rotation_correction.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/standstill.h"

namespace vcharge {
namespace {

// Deviation of the body's rotation from the odometer's that is estimated: braking pitches the body.
constexpr double kBodyRotation_rad = 0.004;
// Least part of the points below the horizon that move as if deeper than the ground if it mirrors. On one
// simulated drive it is 0.07 to 0.14 in the wet, and at most 0.006 at noon.
constexpr double kLeastMirror = 0.03;

}  // namespace

struct ObjectTracker::State {
  PoseHistory poses;
  ObjectFilter filter;
  KnownObstacles obstacles;
  MirrorEvidence mirror{kLeastMirror};
};

ObjectTracker::ObjectTracker(std::shared_ptr<const CameraRig> rig, const ObjectTrackerOptions& options,
                             FrameCallback on_frame)
    : rig_(std::move(rig)),
      options_((options.validate(), options)),
      on_frame_(std::move(on_frame)),
      state_(std::make_unique<State>()),
      people_(std::make_unique<const PersonLikeness>()) {
  std::vector<bool> is_used(rig_->cameras.size(), options_.cameras.empty());
  for (const std::string& name : options_.cameras) {
    is_used[rig_->cameraIndex(name)] = true;
  }
  cameras_.resize(rig_->cameras.size());
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (!is_used[i]) {
      continue;
    }
    if (!rig_->cameras[i].vehicle_from_camera) {
      throw InputError("rig: cameras." + rig_->cameras[i].name + ": expected vehicle_from_camera");
    }
    cameras_[i] = std::make_unique<ObjectCamera>(rig_->cameras[i], options_);
  }
  assembler_ = std::make_unique<ImageFrameAssembler>(
      cameras_.size(), options_.frames, [this](const ImageFrame& frame) { process(frame); },
      [this](DriveBreak /*drive_break*/, Timestamp /*stamp*/) { startOver(); }, is_used);
  assembler_->joinStamps(rig_->stamp_tolerance_s);
}

ObjectTracker::~ObjectTracker() = default;

void ObjectTracker::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < cameras_.size(), "ObjectTracker::addImage: no such camera");
  if (cameras_[camera_index]) {
    assembler_->addImage(camera_index, stamp, image);
  }
}

void ObjectTracker::addOdometry(const VehicleOdometry& odometry) {
  assembler_->addOdometry(odometry);
}

void ObjectTracker::finish() {
  assembler_->finish();
}

void ObjectTracker::startOver() {
  *state_ = State();
  for (const std::unique_ptr<ObjectCamera>& camera : cameras_) {
    if (camera) {
      camera->clear();
    }
  }
}

void ObjectTracker::process(const ImageFrame& frame) {
  state_->poses.correct(frame.corrections);
  if (!frame.odom_from_vehicle) {
    startOver();
    return;
  }
  const RigidTransform now = *frame.odom_from_vehicle;
  state_->poses.add(frame.stamp, now, 1.5 * FollowedPoints::kHistory_s);
  std::vector<ObjectCamera*> views_now;
  for (const size_t camera : addImages(frame)) {
    views_now.push_back(cameras_[camera].get());
  }
  findObjects(views_now, standsAt(assembler_->odometry(), frame.stamp));
  std::vector<RigidTransform> odom_from_cameras;
  for (const std::unique_ptr<ObjectCamera>& camera : cameras_) {
    if (camera) {
      odom_from_cameras.push_back(now * camera->vehicleFromCamera());
    }
  }
  std::vector<TrackedObject> objects = state_->filter.objects(odom_from_cameras);
  // While the vehicle stands, nothing static seems to move, and people may be in the map themselves.
  const double travel_m = state_->poses.beforeFromNow(state_->poses.first()).translation().norm();
  if (options_.ignore_hidden && travel_m > ObjectCamera::kStandstill_m) {
    state_->obstacles.removeHidden(odom_from_cameras, &objects);
  }
  on_frame_({frame.stamp, now, std::move(objects)});
}

/// Adds the images of the cameras that get a turn, and returns those cameras.
std::vector<size_t> ObjectTracker::addImages(const ImageFrame& frame) {
  std::vector<size_t> cameras;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (cameras_[i] && frame.has_image[i]) {
      cameras.push_back(i);
    } else if (cameras_[i]) {
      cameras_[i]->clear();
    }
  }
  if (choose_) {
    cameras = choose_(frame.stamp, frame.has_image);
    std::sort(cameras.begin(), cameras.end());
  }
  for (const size_t camera : cameras) {
    cameras_[camera]->add(frame.images[camera].pixels, state_->poses);
  }
  return cameras;
}

/// Finds objects in the newest images of these cameras and updates the filter.
void ObjectTracker::findObjects(const std::vector<ObjectCamera*>& cameras, bool is_at_rest) {
  const RigidTransform& now = state_->poses.now().odom_from_vehicle;
  std::vector<std::vector<JudgedPoint>> judged;
  std::vector<RotationEquation> equations;
  for (const ObjectCamera* camera : cameras) {
    judged.push_back(camera->judge(state_->poses, &state_->mirror));
    for (const JudgedPoint& point : judged.back()) {
      equations.push_back(point.equation);
    }
  }
  state_->mirror.endImage();
  // The body of the vehicle is rigid: all cameras together tell its rotation, even if one sees little but an
  // object.
  const Eigen::Vector3d rotation = correctRotation(equations, kBodyRotation_rad);
  state_->filter.predict(state_->poses.now().stamp);
  std::vector<PanoramaView> views;
  for (size_t i = 0; i < cameras.size(); ++i) {
    ObjectCamera* camera = cameras[i];
    views.push_back(camera->view());
    if (judged[i].empty()) {
      continue;
    }
    const std::vector<MovingPoint> moving = camera->movingPoints(judged[i], rotation);
    const bool is_compared = camera->compareGround(state_->poses, state_->mirror.isMirror());
    if (is_compared) {
      const CameraMotion motion = camera->motion(state_->poses);
      state_->filter.update(detectObjects(moving, camera->contact(), motion.position_m), now);
      state_->filter.update(findFreestanding(camera->contact(), motion), now);
    }
    camera->follow(state_->poses, is_compared, is_at_rest, &state_->filter);
  }
  lookForPeople(views, now, *people_, &state_->filter);
  followByStereo(views, now, &state_->filter);
  state_->filter.finish();
}

void ObjectTracker::setObstacles(const ObstacleMap& map) {
  if (map.frame_id == "odom") {
    state_->obstacles.set(map);
  }
}

}  // namespace vcharge
