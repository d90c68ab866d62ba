#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A box whose sides run along the axes of the world.
struct WorldBox {
  Eigen::Vector3d min_m, max_m;
};

/// Level ground at z = 0 with boxes on it (or above it), and what cameras measure of it.
struct BoxWorld {
  std::vector<WorldBox> boxes;

  /// Distance along a unit ray; infinity where it meets nothing.
  double castRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
};

/// How range maps of a BoxWorld are made.
struct BoxWorldNoise {
  double relative_sigma = 0.0;  ///< of ranges, reported as it is
  double unknown_share = 0.0;   ///< of the pixels, at random
  uint32_t seed = 1;
};

/// A rig of ideal cameras (256x160, 185 degrees): front, left and right, mounted as on a car.
CameraRig makeBoxWorldRig();

/// What a camera of the rig measures; ranges beyond 30 m are unknown.
RangeMap measureBoxWorld(const BoxWorld& world, const RigCamera& camera,
                         const RigidTransform& world_from_vehicle, Timestamp stamp,
                         const BoxWorldNoise& noise = {});

}  // namespace vcharge
