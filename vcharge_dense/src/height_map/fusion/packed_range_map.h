#pragma once

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/height_map_options.h"

namespace vcharge {

/// A range map as the fusion reads it: per pixel inverse range, its change to the right and downwards, sigma
/// and weight, side by side, so that a voxel between pixels is compared with the surface between them.
struct PackedRangeMap {
  static constexpr int kValues = 5;  // inverse range (0: unknown), by column, by row, sigma in metres, weight

  AlignedArray<float> values;
  int width = 0, height = 0;
  float xi = 0.0F, fx = 0.0F, fy = 0.0F, u0 = 0.0F, v0 = 0.0F;
  float min_cosine = -1.0F;             ///< of the angle from the axis, below which the camera has no image
  float rotation[9] = {};               ///< camera from world, by rows
  Eigen::Vector3d position_m{0, 0, 0};  ///< of the camera in the world
  size_t num_known = 0;
};

/// Ranges that are not finite, not sure enough or too uncertain count as unknown.
PackedRangeMap packRangeMap(const RangeMap& map, const RigidTransform& world_from_camera,
                            const HeightFusionOptions& options);

}  // namespace vcharge
