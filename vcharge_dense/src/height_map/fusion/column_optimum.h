#pragma once

#include <limits>

namespace vcharge {

/// What is kept of a column of voxels.
struct ColumnOptimum {
  int height_index = 0;        ///< of the best height: voxels 0 to height_index - 1 lie below it
  double min_cost = 0.0;       ///< C^min
  double occupied_cost = 0.0;  ///< C^occ: of the column filled to its top
  bool has_surface = false;    ///< something occupied was seen below the best height
  double layer_weight = 0.0;   ///< of the layer whose top the best height is; 0: all below it is one layer
};

/// Voxels first to top - 1 of a column.
struct VoxelRun {
  int first = 0, top = 0;
  double weight = 0.0;  ///< sum of theirs
};

/// The run of voxels from `begin` up whose weights sum to the most; of no voxel where none is positive.
inline VoxelRun heaviestRun(const float* weights, int begin, int num_voxels) {
  VoxelRun heaviest{begin, begin, 0.0};
  double run = 0.0;
  int first = begin;
  for (int z = begin; z < num_voxels; ++z) {
    if (!(run > 0.0)) {
      run = 0.0;
      first = z;
    }
    run += weights[z];
    // A sum in another order may differ in its last bits: that is no heavier run.
    if (run > heaviest.weight + 1e-6) {
      heaviest = {first, z + 1, run};
    }
  }
  return heaviest;
}

/// Height of least cost C(h) = - sum of the weights below h + sum of those from h up (paper, equation
/// perColumnMin); the lowest one where several cost the same. Weights are negative where the data say free.
///
/// One height cannot show what stands over free space: cameras look under a car's body, and where its paint
/// is hardly matched the free space outweighs it. So a column may have layers (Gallup et al. 2010, 3D
/// reconstruction using an n-layer heightmap): a run of voxels above the best height whose weights sum to
/// `min_layer_weight` or more is one, and the height is its top.
inline ColumnOptimum findColumnOptimum(const float* weights, int num_voxels,
                                       double min_layer_weight = std::numeric_limits<double>::infinity()) {
  double cost = 0.0;
  for (int z = 0; z < num_voxels; ++z) {
    cost += weights[z];
  }
  ColumnOptimum best;
  best.min_cost = cost;
  best.occupied_cost = -cost;
  bool occupied_below = false;
  for (int z = 0; z < num_voxels; ++z) {
    cost -= 2.0 * weights[z];
    occupied_below = occupied_below || weights[z] > 0.0F;
    // A sum in another order may differ in its last bits: that is no better height.
    if (cost < best.min_cost - 1e-6) {
      best.height_index = z + 1;
      best.min_cost = cost;
      best.has_surface = occupied_below;
    }
  }
  const VoxelRun layer = heaviestRun(weights, best.height_index, num_voxels);
  if (layer.weight >= min_layer_weight) {
    best.height_index = layer.top;
    best.min_cost -= 2.0 * layer.weight;
    best.has_surface = true;
    best.layer_weight = layer.weight;
  }
  return best;
}

}  // namespace vcharge
