#pragma once

namespace vcharge {

/// What is kept of a column of voxels.
struct ColumnOptimum {
  int height_index = 0;        ///< of the best height: voxels 0 to height_index - 1 lie below it
  double min_cost = 0.0;       ///< C^min
  double occupied_cost = 0.0;  ///< C^occ: of the column filled to its top
  bool has_surface = false;    ///< something occupied was seen below the best height
};

/// Height of least cost C(h) = - sum of the weights below h + sum of those from h up (paper, equation
/// perColumnMin); the lowest one where several cost the same. Weights are negative where the data say free.
inline ColumnOptimum findColumnOptimum(const float* weights, int num_voxels) {
  double cost = 0.0;
  for (int z = 0; z < num_voxels; ++z) {
    cost += weights[z];
  }
  ColumnOptimum best{0, cost, -cost, false};
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
  return best;
}

}  // namespace vcharge
