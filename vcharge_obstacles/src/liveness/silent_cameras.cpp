#include "liveness/silent_cameras.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vcharge {
namespace {

// Images over which the lag is averaged.
constexpr double kLagImages = 10.0;
// Images further ahead of the odometry have a wrong clock.
constexpr double kMaxAhead_s = 5.0;

}  // namespace

bool seesGround(const RigCamera& camera, const Eigen::Vector2d& point_in_vehicle_m) {
  const Eigen::Vector3d point_in_camera =
      camera.vehicle_from_camera->inverse() *
      Eigen::Vector3d(point_in_vehicle_m.x(), point_in_vehicle_m.y(), 0.0);
  const double off_axis_rad = std::atan2(point_in_camera.head<2>().norm(), point_in_camera.z());
  Eigen::Vector2d pixel;
  if (off_axis_rad > 0.5 * camera.field_of_view_rad || !camera.model.project(point_in_camera, &pixel)) {
    return false;
  }
  const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
  return cv::Rect(cv::Point(0, 0), camera.image_size_px).contains(at) &&
         (camera.mask.empty() || camera.mask.at<uint8_t>(at) != 0);
}

SilentCameras::SilentCameras(std::shared_ptr<const CameraRig> rig, std::vector<bool> is_used,
                             double free_range_m)
    : rig_(std::move(rig)),
      is_used_(std::move(is_used)),
      free_range_m_(free_range_m),
      cameras_(is_used_.size()) {}

void SilentCameras::addImage(size_t camera, Timestamp stamp, uint64_t fingerprint,
                             std::optional<Timestamp> odometry_stamp) {
  if (!is_used_[camera]) {
    return;
  }
  if (odometry_stamp) {
    const double lag_s = toSeconds(*odometry_stamp - stamp);
    if (lag_s < -kMaxAhead_s) {
      return;
    }
    cameras_[camera].image_lag_s += (lag_s - cameras_[camera].image_lag_s) / kLagImages;
  }
  cameras_[camera].liveness.addImage(stamp, fingerprint);
}

void SilentCameras::settle(Timestamp until, const CameraLiveness::PoseAt& fixed_from_vehicle_at) {
  for (Camera& camera : cameras_) {
    camera.liveness.settle(until, fixed_from_vehicle_at);
  }
}

void SilentCameras::noteJump() {
  for (Camera& camera : cameras_) {
    camera.liveness.noteJump();
  }
}

void SilentCameras::clear() {
  cameras_.assign(cameras_.size(), Camera());
}

size_t SilentCameras::numSilentAt(Timestamp stamp) const {
  return static_cast<size_t>(std::count_if(cameras_.begin(), cameras_.end(), [&](const Camera& camera) {
    const CameraLiveness::State state = camera.liveness.stateAt(stamp);
    return state == CameraLiveness::State::kSilent || state == CameraLiveness::State::kFrozen;
  }));
}

void SilentCameras::forgetUnwatched(Timestamp from, Timestamp to, LocalObstacleMap* map) const {
  std::vector<const RigCamera*> silent, alive;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (is_used_[i] && cameras_[i].liveness.wasSilent(from, to)) {
      silent.push_back(&rig_->cameras[i]);
    } else if (is_used_[i] && cameras_[i].liveness.isAlive(from, to)) {
      alive.push_back(&rig_->cameras[i]);
    }
  }
  if (silent.empty()) {
    return;
  }
  map->forgetFree([&](const Eigen::Vector2d& point_m) {
    const auto sees = [&](const RigCamera* camera) { return seesGround(*camera, point_m); };
    const auto keepsFree = [&](const RigCamera* camera) {
      const Eigen::Vector2d camera_m = camera->vehicle_from_camera->translation().head<2>();
      return (point_m - camera_m).norm() <= free_range_m_ && seesGround(*camera, point_m);
    };
    return std::any_of(silent.begin(), silent.end(), sees) &&
           std::none_of(alive.begin(), alive.end(), keepsFree);
  });
}

}  // namespace vcharge
