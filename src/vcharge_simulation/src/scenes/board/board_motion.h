#pragma once

#include <cstdint>
#include <vector>

#include "scenes/board/board_pattern.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/vehicle/vehicle_body.h"

namespace vcharge {

/// A board that is held before one camera of the standing car after the other, at kPosesPerCamera places
/// each, out to the rim of the image. At every place all of the board is in the image, stands free of the
/// ground, and nothing of the car is before it.
class BoardMotion {
 public:
  static constexpr int kPosesPerCamera = 40;
  static constexpr double kPose_s = 1.0;
  static constexpr double kMove_s = 0.4;  ///< of a pose's second; it is held for the rest
  static constexpr double kSpan_s = kPosesPerCamera * kPose_s;

  /// Cameras need full-size images (1280x800), for the places to be the same at every scale. The same
  /// arguments give the same places. std::logic_error where a camera sees no place for the board.
  BoardMotion(const CameraRig& rig, const VehicleBody& body, const Eigen::Vector2d& board_size_m,
              const RigidTransform& world_from_vehicle, uint64_t seed);

  /// Camera i has its poses from i kSpan_s on.
  RigidTransform worldFromSheet(double time_s) const;

 private:
  std::vector<std::vector<RigidTransform>> world_from_sheet_;  // of each camera, one after the other
};

}  // namespace vcharge
