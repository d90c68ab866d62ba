#include "vcharge_obstacles/object_tracker.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "bodies/person_likeness.h"
#include "contacts/ground_contact.h"
#include "contacts/ground_motion.h"
#include "objects/freestanding.h"
#include "objects/object_detections.h"
#include "objects/object_filter.h"
#include "objects/object_following.h"
#include "occupancy/known_obstacles.h"
#include "points/followed_points.h"
#include "points/mirror_evidence.h"
#include "points/panorama.h"
#include "points/rotation_correction.h"
#include "points/static_motion.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/standstill.h"

namespace vcharge {
namespace {

// Points are judged from this time after they were first seen.
constexpr double kMinAge_s = 0.15;
// A point moves if its residual is larger than this number of standard deviations and of pixels.
constexpr double kMovingSigmas = 4.0, kMovingPixels = 1.0;
// Side of the patches of a point that are compared, and their least correlation.
constexpr int kPatch_px = 9;
constexpr float kSameAppearance = 0.75F;
// Standard deviation of a followed point, per image.
constexpr double kTracking_px = 0.35;
// Errors of wheel odometry between two images: at standstill, and growing with the square root of the travel,
// as measured over the public 118 s of the V-Charge car.
constexpr double kTranslation_m = 0.001, kTranslationPerSqrt_m = 0.006;
constexpr double kRotation_rad = 0.0003, kRotationPerSqrt_rad = 0.0015;
// Deviation of the body's rotation from the odometer's that is estimated: braking pitches the body.
constexpr double kBodyRotation_rad = 0.004;
// A point is a reflection if it fits something below the ground, and the ground this many times worse than
// that.
constexpr double kReflected = 2.0;
// A static point is at least this far away, and at most this far below the plane of the ground, plus a slope.
constexpr double kMinRange_m = 0.3, kGroundBelow_m = 0.05, kGroundSlope = 0.015;
// Less travel within the history of the points is none.
constexpr double kStandstill_m = 0.05;
// The image with which the ground is compared: at most this long ago and this far back.
constexpr double kCompareInterval_s = 0.42, kCompareTravel_m = 0.5;

/// A followed point that is old enough to be judged, and its equation for the body's rotation.
struct JudgedPoint {
  const PointTrack* track;
  RigidTransform before_from_now;  // motion of the vehicle
  double age_s;
  StaticResidual found;
  RotationEquation equation;
};

WorkingCameraOptions workingOptions(const ObjectTrackerOptions& options) {
  WorkingCameraOptions working;
  working.width_px = options.image_width_px;
  return working;
}

}  // namespace

struct ObjectTracker::State {
  struct Pose {
    Timestamp stamp;
    RigidTransform odom_from_vehicle;
  };
  const Pose* at(Timestamp stamp) const {
    const auto found =
        std::find_if(poses.begin(), poses.end(), [&](const Pose& pose) { return pose.stamp == stamp; });
    return found == poses.end() ? nullptr : &*found;
  }
  std::deque<Pose> poses;  // of the last images
  ObjectFilter filter;
  KnownObstacles obstacles;
  MirrorEvidence mirror;
};

struct ObjectTracker::Camera {
  Camera(const RigCamera& camera, const ObjectTrackerOptions& options)
      : vehicle_from_camera(*camera.vehicle_from_camera),
        working(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask,
                workingOptions(options)),
        focal_px(working.model().gamma1() / (1.0 + working.model().xi())),
        sigma_rad(kTracking_px * M_SQRT2 / focal_px),
        points(working, vehicle_from_camera),
        contact(working, vehicle_from_camera, options.max_range_m),
        panorama(camera) {}

  void add(Timestamp stamp, const cv::Mat& sensor_image, const RigidTransform& previous_from_now) {
    const cv::Mat image = working.undistort(sensor_image);
    points.add(stamp, image, previous_from_now);
    images.emplace_back(stamp, image);
    panorama_before = panorama_now;
    panorama_now = panorama.render(sensor_image);
    while (toSeconds(stamp - images.front().first) > kCompareInterval_s) {
      images.pop_front();
    }
  }
  void clear() {
    points.clear();
    images.clear();
    panorama_now = cv::Mat();
  }
  std::vector<JudgedPoint> judge(const State& state, MirrorEvidence* mirror) const;
  std::vector<MovingPoint> movingPoints(const std::vector<JudgedPoint>& judged,
                                        const Eigen::Vector3d& rotation) const;
  bool compareGround(const State& state);
  void follow(State* state, bool is_compared, bool is_at_rest) const;
  CameraMotion motion(const State& state) const;
  /// Motion of the vehicle since an image, such that the ground fits.
  RigidTransform groundMotion(Timestamp before, const RigidTransform& before_from_now) const {
    return fitGroundMotion(before_from_now,
                           rayPairsSince(before, points.tracks(), vehicle_from_camera.rotation()),
                           vehicle_from_camera.translation(), sigma_rad);
  }

  /// Whether a point still has the appearance of its first observation: others have slid along an edge.
  bool hasKeptAppearance(const PointTrack& track) const {
    for (const auto& [stamp, image] : images) {
      if (stamp == track.front().stamp) {
        cv::Mat before, now;
        cv::getRectSubPix(image, cv::Size(kPatch_px, kPatch_px), track.front().position_px, before);
        cv::getRectSubPix(images.back().second, cv::Size(kPatch_px, kPatch_px), track.back().position_px,
                          now);
        cv::Mat correlation;
        cv::matchTemplate(now, before, correlation, cv::TM_CCOEFF_NORMED);
        return correlation.at<float>(0) > kSameAppearance;
      }
    }
    return false;
  }

  const RigidTransform vehicle_from_camera;
  const WorkingCamera working;
  const double focal_px;   // in the middle of the image, per radian
  const double sigma_rad;  // of the motion of a point between two images
  FollowedPoints points;
  GroundContact contact;
  const PersonLikeness people;
  const Panorama panorama;
  cv::Mat panorama_before, panorama_now;  // empty without images
  std::deque<std::pair<Timestamp, cv::Mat>> images;
};

ObjectTracker::ObjectTracker(std::shared_ptr<const CameraRig> rig, const ObjectTrackerOptions& options,
                             FrameCallback on_frame)
    : rig_(std::move(rig)),
      options_((options.validate(), options)),
      on_frame_(std::move(on_frame)),
      state_(std::make_unique<State>()) {
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
    cameras_[i] = std::make_unique<Camera>(rig_->cameras[i], options_);
  }
  assembler_ = std::make_unique<ImageFrameAssembler>(
      cameras_.size(), options_.frames, [this](const ImageFrame& frame) { process(frame); },
      [this](DriveBreak /*drive_break*/, Timestamp /*stamp*/) { startOver(); }, is_used);
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
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      camera->clear();
    }
  }
}

std::vector<JudgedPoint> ObjectTracker::Camera::judge(const State& state, MirrorEvidence* mirror) const {
  std::vector<JudgedPoint> judged;
  const bool is_mirror = mirror->isMirror();
  const State::Pose& now = state.poses.back();
  const double height_m = vehicle_from_camera.translation().z();
  for (const PointTrack& track : points.tracks()) {
    const State::Pose* before = state.at(track.front().stamp);
    const double age_s = toSeconds(now.stamp - track.front().stamp);
    if (before == nullptr || age_s < kMinAge_s) {
      continue;
    }
    JudgedPoint point{&track, before->odom_from_vehicle.inverse() * now.odom_from_vehicle, age_s, {}, {}};
    // The ground, lowered by its tolerance, is the farthest that a point can be.
    const double down = -(vehicle_from_camera.rotation() * track.back().ray_in_camera).z() - kGroundSlope;
    const double min_inverse_per_m = std::max(0.0, down / (height_m + kGroundBelow_m));
    const RigidTransform camera_before_from_now =
        vehicle_from_camera.inverse() * point.before_from_now * vehicle_from_camera;
    const auto compareFrom = [&](double least_inverse_per_m) {
      return compareWithStatic({track.back().ray_in_camera, track.front().ray_in_camera},
                               camera_before_from_now, least_inverse_per_m,
                               std::max(1.0 / kMinRange_m, min_inverse_per_m));
    };
    point.found = compareFrom(min_inverse_per_m);
    if (min_inverse_per_m > 0.0 && point.found.is_valid &&
        point.before_from_now.translation().norm() > kStandstill_m) {
      // Reflections in the ground move as static points below it do.
      const StaticResidual deeper = compareFrom(0.0);
      const double limit_rad = kMovingSigmas * sigma_rad;
      mirror->add(deeper.is_valid && deeper.residual_rad.norm() < limit_rad &&
                  point.found.residual_rad.norm() > kReflected * limit_rad);
      point.found = is_mirror && deeper.is_valid ? deeper : point.found;
    }
    if (!point.found.is_valid) {
      continue;
    }
    point.equation =
        rotationEquationOf(point.found, track.front().ray_in_camera, age_s / FollowedPoints::kHistory_s,
                           vehicle_from_camera.rotationMatrix(), sigma_rad);
    judged.push_back(point);
  }
  return judged;
}

std::vector<MovingPoint> ObjectTracker::Camera::movingPoints(const std::vector<JudgedPoint>& judged,
                                                             const Eigen::Vector3d& rotation) const {
  std::vector<MovingPoint> moving;
  for (const JudgedPoint& point : judged) {
    const Eigen::Vector2d left = point.equation.residual_rad - point.equation.by_rotation * rotation;
    const double residual_rad = point.equation.has_second ? left.norm() : std::abs(left.x());
    const double travel_m = point.before_from_now.translation().norm();
    const double translation_rad =
        (kTranslation_m + kTranslationPerSqrt_m * std::sqrt(travel_m)) * point.found.inverse_range_per_m;
    const double rotation_rad = kRotation_rad + kRotationPerSqrt_rad * std::sqrt(travel_m);
    if (residual_rad > kMovingSigmas * std::hypot(sigma_rad, translation_rad, rotation_rad) &&
        residual_rad > kMovingPixels / focal_px && hasKeptAppearance(*point.track)) {
      const RigidTransform turned(rotationFromVector(-point.age_s / FollowedPoints::kHistory_s * rotation),
                                  Eigen::Vector3d::Zero());
      moving.push_back({vehicle_from_camera.rotation() * point.track->back().ray_in_camera,
                        vehicle_from_camera.rotation() * point.track->front().ray_in_camera,
                        turned * point.before_from_now, point.age_s, sigma_rad});
    }
  }
  return moving;
}

/// Compares the ground with that of the oldest image that was taken near enough; false without an earlier
/// image.
bool ObjectTracker::Camera::compareGround(const State& state) {
  for (size_t i = 0; i + 1 < images.size(); ++i) {
    const auto& [stamp, image] = images[i];
    const State::Pose* before = state.at(stamp);
    if (before == nullptr) {
      continue;
    }
    const RigidTransform before_from_now =
        before->odom_from_vehicle.inverse() * state.poses.back().odom_from_vehicle;
    const double travel_m = before_from_now.translation().norm();
    if (travel_m < kCompareTravel_m || i + 2 == images.size()) {
      contact.compare(images.back().second, image, groundMotion(stamp, before_from_now),
                      travel_m > kStandstill_m && state.mirror.isMirror());
      return true;
    }
  }
  return false;
}

CameraMotion ObjectTracker::Camera::motion(const State& state) const {
  const State::Pose& before = state.poses.front();
  const State::Pose& now = state.poses.back();
  return motionOf(vehicle_from_camera, now.odom_from_vehicle.inverse() * before.odom_from_vehicle,
                  toSeconds(now.stamp - before.stamp));
}

/// Finds the objects that are expected in the image.
void ObjectTracker::Camera::follow(State* state, bool is_compared, bool is_at_rest) const {
  if (state->poses.size() < 2 || panorama_before.empty()) {
    return;
  }
  const State::Pose& before = state->poses[state->poses.size() - 2];
  const State::Pose& now = state->poses.back();
  const TwoViews views{panorama,
                       panorama_before,
                       panorama_now,
                       before.odom_from_vehicle,
                       now.odom_from_vehicle,
                       toSeconds(now.stamp - before.stamp),
                       vehicle_from_camera.translation(),
                       is_at_rest};
  followObjects(views, is_compared ? &contact : nullptr, people, &state->filter);
}

void ObjectTracker::process(const ImageFrame& frame) {
  for (State::Pose& pose : state_->poses) {
    if (const CorrectedPose* corrected = correctionAt(frame.corrections, pose.stamp)) {
      pose.odom_from_vehicle = corrected->odom_from_vehicle;
    }
  }
  if (!frame.odom_from_vehicle) {
    startOver();
    return;
  }
  const RigidTransform now = *frame.odom_from_vehicle;
  const RigidTransform previous_from_now =
      state_->poses.empty() ? RigidTransform() : state_->poses.back().odom_from_vehicle.inverse() * now;
  state_->poses.push_back({frame.stamp, now});
  while (toSeconds(frame.stamp - state_->poses.front().stamp) > 1.5 * FollowedPoints::kHistory_s) {
    state_->poses.pop_front();
  }
  const bool is_at_rest = standsAt(assembler_->odometry(), frame.stamp);
  std::vector<std::vector<JudgedPoint>> judged(cameras_.size());
  std::vector<RotationEquation> equations;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    Camera* camera = cameras_[i].get();
    if (camera == nullptr) {
      continue;
    }
    if (!frame.has_image[i]) {
      camera->clear();
      continue;
    }
    camera->add(frame.stamp, frame.images[i].pixels, previous_from_now);
    judged[i] = camera->judge(*state_, &state_->mirror);
    for (const JudgedPoint& point : judged[i]) {
      equations.push_back(point.equation);
    }
  }
  state_->mirror.endImage();
  // The body of the vehicle is rigid: all cameras together tell its rotation, even if one sees little but an
  // object.
  const Eigen::Vector3d rotation = correctRotation(equations, kBodyRotation_rad);
  state_->filter.predict(frame.stamp);
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (judged[i].empty()) {
      continue;
    }
    const std::vector<MovingPoint> moving = cameras_[i]->movingPoints(judged[i], rotation);
    const bool is_compared = cameras_[i]->compareGround(*state_);
    if (is_compared) {
      const CameraMotion motion = cameras_[i]->motion(*state_);
      state_->filter.update(detectObjects(moving, cameras_[i]->contact, motion.position_m), now);
      state_->filter.update(findFreestanding(cameras_[i]->contact, motion), now);
    }
    cameras_[i]->follow(state_.get(), is_compared, is_at_rest);
  }
  std::vector<PanoramaView> views;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera && !camera->panorama_now.empty()) {
      views.push_back({camera->panorama, camera->panorama_now, camera->vehicle_from_camera.translation()});
    }
  }
  followByStereo(views, now, &state_->filter);
  state_->filter.finish();
  std::vector<RigidTransform> odom_from_cameras;
  for (const std::unique_ptr<Camera>& camera : cameras_) {
    if (camera) {
      odom_from_cameras.push_back(now * camera->vehicle_from_camera);
    }
  }
  std::vector<TrackedObject> objects = state_->filter.objects(odom_from_cameras);
  // While the vehicle stands, nothing static seems to move, and people may be in the map themselves.
  const double travel_m = (state_->poses.front().odom_from_vehicle.inverse() * now).translation().norm();
  if (options_.ignore_hidden && travel_m > kStandstill_m) {
    state_->obstacles.removeHidden(odom_from_cameras, &objects);
  }
  on_frame_({frame.stamp, now, std::move(objects)});
}

void ObjectTracker::setObstacles(const ObstacleMap& map) {
  if (map.frame_id == "odom") {
    state_->obstacles.set(map);
  }
}

}  // namespace vcharge
