#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

struct StampedTransform {
  Timestamp stamp;
  RigidTransform world_from_vehicle;
};

/// Stamps are strictly increasing.
using Trajectory = std::vector<StampedTransform>;

/// Reads TUM text: "time_s tx ty tz qx qy qz qw" per line; '#' starts a comment. Throws InputError naming the
/// file and the line for anything else, for stamps that do not increase and for rotations whose norm differs
/// from 1 by more than 1e-3.
Trajectory readTrajectory(const std::string& path);
/// Writes stamps exact to the nanosecond. Replaces an older file only when the new one is complete.
void writeTrajectory(const Trajectory& trajectory, const std::string& path);

}  // namespace vcharge
