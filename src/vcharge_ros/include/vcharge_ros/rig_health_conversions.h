#pragma once

#include <optional>

#include <vcharge_msgs/RigHealth.h>

#include "vcharge_core/camera/rig_condition.h"

namespace vcharge {

/// Topic of vcharge_msgs/RigHealth.
inline constexpr char kRigHealthTopic[] = "/calibration/health";

/// The condition of `rig` after a message on kRigHealthTopic; nothing if the message is about other
/// extrinsics. InputError that names the topic for a camera that is not in the rig, or is missing, and for
/// poses and deviations that are not valid.
std::optional<RigCondition> fromMessage(const vcharge_msgs::RigHealth& message, const CameraRig& rig);

}  // namespace vcharge
