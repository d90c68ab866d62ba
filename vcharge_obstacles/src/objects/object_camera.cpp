#include "objects/object_camera.h"

#include <cmath>

#include <opencv2/imgproc.hpp>

#include "contacts/ground_motion.h"
#include "objects/object_following.h"

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
// A point is a reflection if it fits something below the ground, and the ground this many times worse than
// that.
constexpr double kReflected = 2.0;
// A static point is at least this far away, and at most this far below the plane of the ground, plus a slope.
constexpr double kMinRange_m = 0.3, kGroundBelow_m = 0.05, kGroundSlope = 0.015;
// The image with which the ground is compared: at most this long ago and this far back.
constexpr double kCompareInterval_s = 0.42, kCompareTravel_m = 0.5;

WorkingCameraOptions workingOptions(const ObjectTrackerOptions& options) {
  WorkingCameraOptions working;
  working.width_px = options.image_width_px;
  return working;
}

}  // namespace

ObjectCamera::ObjectCamera(const RigCamera& camera, const ObjectTrackerOptions& options)
    : vehicle_from_camera_(*camera.vehicle_from_camera),
      working_(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask,
               workingOptions(options)),
      focal_px_(working_.model().gamma1() / (1.0 + working_.model().xi())),
      sigma_rad_(kTracking_px * M_SQRT2 / focal_px_),
      points_(working_, vehicle_from_camera_),
      contact_(working_, vehicle_from_camera_, options.max_range_m),
      panorama_(camera) {}

void ObjectCamera::add(const cv::Mat& sensor_image, const PoseHistory& poses) {
  const Timestamp stamp = poses.now().stamp;
  const PoseHistory::Pose* last = now_.image.empty() ? nullptr : poses.at(now_.stamp);
  if (last == nullptr) {
    clear();
  }
  const cv::Mat image = working_.undistort(sensor_image);
  points_.add(stamp, image, last == nullptr ? RigidTransform() : poses.beforeFromNow(*last));
  images_.emplace_back(stamp, image);
  before_ = now_;
  now_ = {stamp, panorama_.render(sensor_image)};
  while (toSeconds(stamp - images_.front().first) > kCompareInterval_s) {
    images_.pop_front();
  }
}

void ObjectCamera::clear() {
  points_.clear();
  images_.clear();
  now_ = Rendered();
}

/// Motion of the vehicle since an image, such that the ground fits.
RigidTransform ObjectCamera::groundMotion(Timestamp before, const RigidTransform& before_from_now) const {
  return fitGroundMotion(before_from_now,
                         rayPairsSince(before, points_.tracks(), vehicle_from_camera_.rotation()),
                         vehicle_from_camera_.translation(), sigma_rad_);
}

/// Whether a point still has the appearance of its first observation: others have slid along an edge.
bool ObjectCamera::hasKeptAppearance(const PointTrack& track) const {
  for (const auto& [stamp, image] : images_) {
    if (stamp == track.front().stamp) {
      cv::Mat before, now;
      cv::getRectSubPix(image, cv::Size(kPatch_px, kPatch_px), track.front().position_px, before);
      cv::getRectSubPix(images_.back().second, cv::Size(kPatch_px, kPatch_px), track.back().position_px, now);
      cv::Mat correlation;
      cv::matchTemplate(now, before, correlation, cv::TM_CCOEFF_NORMED);
      return correlation.at<float>(0) > kSameAppearance;
    }
  }
  return false;
}

std::vector<JudgedPoint> ObjectCamera::judge(const PoseHistory& poses, MirrorEvidence* mirror) const {
  std::vector<JudgedPoint> judged;
  const bool is_mirror = mirror->isMirror();
  const PoseHistory::Pose& now = poses.now();
  const double height_m = vehicle_from_camera_.translation().z();
  for (const PointTrack& track : points_.tracks()) {
    const PoseHistory::Pose* before = poses.at(track.front().stamp);
    const double age_s = toSeconds(now.stamp - track.front().stamp);
    if (before == nullptr || age_s < kMinAge_s) {
      continue;
    }
    JudgedPoint point{&track, poses.beforeFromNow(*before), age_s, {}, {}};
    // The ground, lowered by its tolerance, is the farthest that a point can be.
    const double down = -(vehicle_from_camera_.rotation() * track.back().ray_in_camera).z() - kGroundSlope;
    const double min_inverse_per_m = std::max(0.0, down / (height_m + kGroundBelow_m));
    const RigidTransform camera_before_from_now =
        vehicle_from_camera_.inverse() * point.before_from_now * vehicle_from_camera_;
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
      const double limit_rad = kMovingSigmas * sigma_rad_;
      const bool is_reflection = deeper.is_valid && deeper.residual_rad.norm() < limit_rad &&
                                 point.found.residual_rad.norm() > kReflected * limit_rad;
      mirror->add(1, is_reflection ? 1 : 0);
      point.found = is_mirror && deeper.is_valid ? deeper : point.found;
    }
    if (!point.found.is_valid) {
      continue;
    }
    point.equation =
        rotationEquationOf(point.found, track.front().ray_in_camera, age_s / FollowedPoints::kHistory_s,
                           vehicle_from_camera_.rotationMatrix(), sigma_rad_);
    judged.push_back(point);
  }
  return judged;
}

std::vector<MovingPoint> ObjectCamera::movingPoints(const std::vector<JudgedPoint>& judged,
                                                    const Eigen::Vector3d& rotation) const {
  std::vector<MovingPoint> moving;
  for (const JudgedPoint& point : judged) {
    const Eigen::Vector2d left = point.equation.residual_rad - point.equation.by_rotation * rotation;
    const double residual_rad = point.equation.has_second ? left.norm() : std::abs(left.x());
    const double travel_m = point.before_from_now.translation().norm();
    const double translation_rad =
        (kTranslation_m + kTranslationPerSqrt_m * std::sqrt(travel_m)) * point.found.inverse_range_per_m;
    const double rotation_rad = kRotation_rad + kRotationPerSqrt_rad * std::sqrt(travel_m);
    if (residual_rad > kMovingSigmas * std::hypot(sigma_rad_, translation_rad, rotation_rad) &&
        residual_rad > kMovingPixels / focal_px_ && hasKeptAppearance(*point.track)) {
      const RigidTransform turned(rotationFromVector(-point.age_s / FollowedPoints::kHistory_s * rotation),
                                  Eigen::Vector3d::Zero());
      moving.push_back({vehicle_from_camera_.rotation() * point.track->back().ray_in_camera,
                        vehicle_from_camera_.rotation() * point.track->front().ray_in_camera,
                        turned * point.before_from_now, point.age_s, sigma_rad_});
    }
  }
  return moving;
}

bool ObjectCamera::compareGround(const PoseHistory& poses, bool is_mirror) {
  for (size_t i = 0; i + 1 < images_.size(); ++i) {
    const auto& [stamp, image] = images_[i];
    const PoseHistory::Pose* before = poses.at(stamp);
    if (before == nullptr) {
      continue;
    }
    const RigidTransform before_from_now = poses.beforeFromNow(*before);
    const double travel_m = before_from_now.translation().norm();
    if (travel_m < kCompareTravel_m || i + 2 == images_.size()) {
      contact_.compare(images_.back().second, image, groundMotion(stamp, before_from_now),
                       travel_m > kStandstill_m && is_mirror);
      return true;
    }
  }
  return false;
}

CameraMotion ObjectCamera::motion(const PoseHistory& poses) const {
  const PoseHistory::Pose& before = poses.first();
  return motionOf(vehicle_from_camera_, poses.beforeFromNow(before).inverse(),
                  toSeconds(poses.now().stamp - before.stamp));
}

void ObjectCamera::follow(const PoseHistory& poses, bool is_compared, bool is_at_rest,
                          ObjectFilter* filter) const {
  const PoseHistory::Pose* before = before_.image.empty() ? nullptr : poses.at(before_.stamp);
  if (before == nullptr) {
    return;
  }
  const PoseHistory::Pose& now = poses.now();
  const TwoViews views{panorama_,
                       before_.image,
                       now_.image,
                       before->odom_from_vehicle,
                       now.odom_from_vehicle,
                       toSeconds(now.stamp - before->stamp),
                       vehicle_from_camera_.translation(),
                       is_at_rest};
  followObjects(views, is_compared ? &contact_ : nullptr, filter);
}

}  // namespace vcharge
