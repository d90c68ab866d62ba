#pragma once

#include <cstdint>
#include <vector>

#include "scenes/board/board_pattern.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/vehicle/vehicle_body.h"

namespace vcharge {

/// A calibration board held in front of each camera of the standing car in turn, at kPosesPerCamera poses
/// each, out to the rim of the image. In every pose the whole board is in the image, above the ground, and
/// not occluded by the car.
class BoardMotion {
 public:
  static constexpr int kPosesPerCamera = 40;
  static constexpr double kPose_s = 1.0;
  static constexpr double kMove_s =
      0.4;  ///< time between two poses; the board stands still for the rest of kPose_s
  static constexpr double kSpan_s = kPosesPerCamera * kPose_s;

  /// `rig` must be for full-size images (1280x800), so that poses do not depend on the image scale. The same
  /// arguments give the same poses. Throws std::logic_error if a camera has no visible pose.
  BoardMotion(const CameraRig& rig, const VehicleBody& body, const Eigen::Vector2d& board_size_m,
              const RigidTransform& world_from_vehicle, uint64_t seed);

  /// The poses for camera i start at time i * kSpan_s.
  RigidTransform worldFromSheet(double time_s) const;

 private:
  std::vector<std::vector<RigidTransform>> world_from_sheet_;  // per camera
};

}  // namespace vcharge
