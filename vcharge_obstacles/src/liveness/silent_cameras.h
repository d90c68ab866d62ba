#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "liveness/camera_liveness.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_obstacles/local_obstacle_map.h"

namespace vcharge {

/// Lag of a camera's images from which it is reported.
inline constexpr double kLateImages_s = 0.08;

/// Whether a point on the ground (vehicle frame, z = 0) has a valid pixel in the camera's image.
bool seesGround(const RigCamera& camera, const Eigen::Vector2d& point_in_vehicle_m);

/// Follows which cameras of a rig are silent or frozen, and makes the ground that only they see unknown.
class SilentCameras {
 public:
  /// Cameras that are not in use are ignored. A living camera keeps ground free within free_range_m.
  SilentCameras(std::shared_ptr<const CameraRig> rig, std::vector<bool> is_used, double free_range_m);

  /// `odometry_stamp`: the newest odometry when the image arrived, if there is any.
  void addImage(size_t camera, Timestamp stamp, uint64_t fingerprint,
                std::optional<Timestamp> odometry_stamp);
  void settle(Timestamp until, const CameraLiveness::PoseAt& fixed_from_vehicle_at);
  void addRangeMap(size_t camera, Timestamp stamp) { cameras_[camera].liveness.addRangeMap(stamp); }
  void noteJump();
  /// The drive starts again.
  void clear();

  const CameraLiveness& liveness(size_t camera) const { return cameras_[camera].liveness; }
  /// Mean time by which the last images were older than the odometry on their arrival.
  double imageLag_s(size_t camera) const { return cameras_[camera].image_lag_s; }
  size_t numSilentAt(Timestamp stamp) const;

  /// Makes free cells unknown that a camera sees which was silent at some time in (from, to], and no camera
  /// that delivered all that time. Uses the map's present pose.
  void forgetUnwatched(Timestamp from, Timestamp to, LocalObstacleMap* map) const;

 private:
  struct Camera {
    CameraLiveness liveness;
    double image_lag_s = 0.0;
  };

  std::shared_ptr<const CameraRig> rig_;
  std::vector<bool> is_used_;
  double free_range_m_;
  std::vector<Camera> cameras_;
};

}  // namespace vcharge
