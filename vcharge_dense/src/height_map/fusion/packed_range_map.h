#pragma once

#include <opencv2/core.hpp>

#include "kernels/aligned_array.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A range map in the form that the fusion reads: per pixel inverse range, its change to the right and
/// downwards, standard deviation and weight, so that a voxel between pixels is compared with an interpolated
/// surface.
struct PackedRangeMap {
  static constexpr int kValues =
      5;  // inverse range (0: unknown), change by column and by row, sigma in metres, weight

  AlignedArray<float> values;
  int width = 0, height = 0;
  float xi = 0.0F, fx = 0.0F, fy = 0.0F, u0 = 0.0F, v0 = 0.0F;
  float min_cosine = -1.0F;             ///< cosine of the largest angle from the axis that is visible
  float rotation[9] = {};               ///< camera from world, row-major
  Eigen::Vector3d position_m{0, 0, 0};  ///< camera position in the world
  size_t num_known = 0;
};

/// How much a range counts in the fusion. Only tests change the references.
struct RangeWeighting {
  double reference_sigma_m = 0.05;    ///< the weight of a range with this standard deviation is one half
  double reference_confidence = 0.9;  ///< the weight grows with the log odds of the confidence and is 1 here
  /// The weight of a range whose pixel spans this much of the surface is one half. Distant ground is seen at
  /// grazing angles, where a matching window covers both sides of a kerb.
  double reference_footprint_m = 0.15;
  double view_weight = 1.0;  ///< factor of all weights of a range map
};

/// Ranges that are not finite, or have a low confidence or a large standard deviation, become unknown.
PackedRangeMap packRangeMap(const RangeMap& map, const RigidTransform& world_from_camera,
                            const RangeWeighting& weighting = {});

}  // namespace vcharge
