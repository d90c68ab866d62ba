#pragma once

#include "vcharge_core/frames/drive_odometry.h"

namespace vcharge {

/// Whether the vehicle stands at a stamp: in the 0.1 s before, it moved by less than 0.02 m/s and turned by
/// less than 0.01 rad/s. If the odometry reaches back less far, in the 0.04 s before; if that is not known
/// either, the vehicle counts as standing.
///
/// A function of the poses: stages that get the same odometry agree on every stamp, whatever else they drop.
bool standsAt(const DriveOdometry& odometry, Timestamp stamp);

}  // namespace vcharge
