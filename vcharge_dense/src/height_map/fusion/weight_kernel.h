#pragma once

#include "height_map/fusion/packed_range_map.h"

namespace vcharge {

/// How a ray's weight runs along it: see HeightFusionOptions.
struct WeightProfile {
  float max_range_m, band_m, min_ramp_m, free_weight;

  explicit WeightProfile(const HeightFusionOptions& options);
};

/// The voxels of one column as seen from a camera.
struct VoxelColumn {
  float first[3];  ///< centre of the lowest voxel in the camera's frame, metres
  float step[3];   ///< from a voxel to the one above it
  int count;       ///< of voxels, a multiple of kVoxelLanes
};

constexpr int kVoxelLanes = 16;  // of the widest vectors

/// Adds a range map's weight to each voxel of a column: negative in front of the surface on the voxel's ray,
/// rising over sigma to positive in a band behind it, zero beyond; times the range's weight.
using AddColumnWeights = void (*)(const PackedRangeMap& map, const WeightProfile& profile,
                                  const VoxelColumn& column, float* weights);

/// The best one for this machine.
AddColumnWeights addColumnWeightsKernel();

}  // namespace vcharge
