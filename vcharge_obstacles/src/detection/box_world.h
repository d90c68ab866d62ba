#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// An axis-aligned box.
struct WorldBox {
  Eigen::Vector3d min_m, max_m;
};

/// Level ground at z = 0 with boxes on or above it.
struct BoxWorld {
  std::vector<WorldBox> boxes;

  /// Distance along a unit ray to the first surface; infinity without one.
  double castRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
};

/// Errors of simulated range maps.
struct BoxWorldNoise {
  double relative_sigma = 0.0;    ///< relative error of the ranges, also reported as their standard deviation
  double unknown_fraction = 0.0;  ///< fraction of pixels without a range, chosen at random
  uint32_t seed = 1;
};

/// A rig of ideal cameras (256x160, 185 degrees) mounted as on a car: front, left and right.
CameraRig makeBoxWorldRig();

/// Simulates the range map of a camera of the rig; ranges beyond 30 m are unknown.
RangeMap measureBoxWorld(const BoxWorld& world, const RigCamera& camera,
                         const RigidTransform& world_from_vehicle, Timestamp stamp,
                         const BoxWorldNoise& noise = {});

}  // namespace vcharge
