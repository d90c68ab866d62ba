#pragma once

#include "height_map/fusion/packed_range_map.h"
#include "vcharge_dense/height_map_options.h"

namespace vcharge {

/// How a range's weight varies along its ray.
struct WeightProfile {
  float max_range_m;
  float band_m = 0.15F;      ///< voxels are occupied up to this distance behind the surface, unknown beyond
  float min_ramp_m = 0.01F;  ///< the weight rises from free to occupied over sigma, at least over this
  float free_weight;

  explicit WeightProfile(const HeightFusionOptions& options);
};

/// The voxels of one column in a camera's frame.
struct VoxelColumn {
  float first[3];  ///< centre of the lowest voxel in the camera's frame, metres
  float step[3];   ///< difference from a voxel to the one above it
  int count;       ///< number of voxels, a multiple of kVoxelLanes
};

constexpr int kVoxelLanes = 16;  // lanes of the widest vectors

/// Adds a range map's weight to each voxel of a column: negative in front of the surface on the voxel's ray,
/// rising over sigma to positive in a band behind it and zero beyond, times the weight of the range.
using AddColumnWeights = void (*)(const PackedRangeMap& map, const WeightProfile& profile,
                                  const VoxelColumn& column, float* weights);

/// The kernel of the best instruction set of this machine.
AddColumnWeights addColumnWeightsKernel();

}  // namespace vcharge
