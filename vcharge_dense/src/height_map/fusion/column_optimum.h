#pragma once

#include <limits>

namespace vcharge {

/// Best height of a column of voxels.
struct ColumnOptimum {
  int height_index = 0;        ///< number of voxels below the best height
  double min_cost = 0.0;       ///< C^min
  double occupied_cost = 0.0;  ///< C^occ: cost of the column filled to its top
  bool has_surface = false;    ///< a voxel below the best height is occupied
  double layer_weight = 0.0;   ///< weight of the layer that ends at the best height; 0: no layer
};

/// The voxels first to top - 1 of a column.
struct VoxelRun {
  int first = 0, top = 0;
  double weight = 0.0;  ///< sum of the voxels' weights
};

/// The run of voxels from `begin` up with the largest sum of weights; empty where no weight is positive.
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
    // The margin exceeds rounding errors of sums in another order.
    if (run > heaviest.weight + 1e-6) {
      heaviest = {first, z + 1, run};
    }
  }
  return heaviest;
}

/// Height of least cost C(h) = - sum of the weights below h + sum of the weights from h up (paper, equation
/// perColumnMin); the lowest one of equal costs. Weights are negative where space is free.
///
/// One height cannot represent an object above free space: cameras see under a car's body, and if its paint
/// has few matches the free space outweighs it. Therefore a run of voxels above the best height whose weights
/// sum to at least `min_layer_weight` is a layer, and its top is the height (Gallup et al. 2010, 3D
/// reconstruction using an n-layer heightmap).
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
    // The margin exceeds rounding errors of sums in another order.
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
