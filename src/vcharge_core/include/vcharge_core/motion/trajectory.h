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

/// Strictly increasing stamps.
using Trajectory = std::vector<StampedTransform>;

/// TUM text: "time_s tx ty tz qx qy qz qw" per line, '#' starts a comment. InputError naming file and line
/// for anything else, for stamps that do not increase and for rotations whose norm is off by more than 1e-3.
Trajectory readTrajectory(const std::string& path);
/// Exact in time to the nanosecond; replaces the file only once it is complete.
void writeTrajectory(const Trajectory& trajectory, const std::string& path);

}  // namespace vcharge
