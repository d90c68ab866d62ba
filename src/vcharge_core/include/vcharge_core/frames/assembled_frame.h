#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/frames/image.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_core/motion/vehicle_rates.h"

namespace vcharge {

/// Pose of a frame that was handed out with another one, before the odometry corrected it.
struct CorrectedPose {
  Timestamp stamp;
  RigidTransform odom_from_vehicle;
  RigidTransform bridged_from_vehicle;
  RigidTransform old_vehicle_from_vehicle;  ///< the correction itself
};

/// The pose that a correction gives the frame at this stamp; null without one.
inline const CorrectedPose* correctionAt(const std::vector<CorrectedPose>& corrections, Timestamp stamp) {
  for (const CorrectedPose& corrected : corrections) {
    if (corrected.stamp == stamp) {
      return &corrected;
    }
  }
  return nullptr;
}

/// Images of one stamp, or of stamps near it, and the pose of the vehicle at that time. An ImageType is the
/// data of one camera: gray pixels, or something computed from them.
template <class ImageType>
struct AssembledFrame {
  Timestamp stamp;
  std::vector<ImageType> images;  ///< in the rig's order; default-constructed where a camera sent none
  std::vector<bool> has_image;    ///< one per camera
  /// Pose as counted by the odometer; absent inside gaps, across resets, or if no odometry came in time.
  std::optional<RigidTransform> odom_from_vehicle;
  /// Pose in a frame without jumps: resets of the odometer are bridged by the velocities before them.
  std::optional<RigidTransform> bridged_from_vehicle;
  FrameMotion motion;  ///< rates where there is a pose
  /// Reason why there is no pose.
  OdometryBuffer::LookupStatus odometry_status = OdometryBuffer::LookupStatus::kEmpty;
  int64_t num_resets = 0;  ///< resets of the odometer before this frame
  /// Frames of the last second whose poses changed since the previous frame, in order of stamps. The pose at
  /// an image's stamp is extrapolated if the wheels' data are late; the next message corrects it.
  std::vector<CorrectedPose> corrections;
};
using ImageFrame = AssembledFrame<Image>;

}  // namespace vcharge
