#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {

/// Options of the voxel grid and its weights (paper, section Height Map Fusion; Haene 2011).
struct HeightFusionOptions {
  VCHARGE_BEGIN_OPTIONS(HeightFusionOptions);
  VCHARGE_OPTION(double, cell_size_m, 0.05, positive(), "Side of a cell of the map.");
  VCHARGE_OPTION(double, height_step_m, 0.0125, positive(),
                 "Height of a voxel; smoothing lowers steps by up to one voxel.");
  VCHARGE_OPTION(double, min_height_m, -0.5, anyValue(),
                 "Lowest height of the grid, above the lowest pose of the vehicle.");
  VCHARGE_OPTION(
      double, max_height_m, 2.0, anyValue(),
      "Highest height of the grid, above the highest pose of the vehicle; lower than a garage's ceiling.");
  VCHARGE_OPTION(
      double, max_range_m, 8.0, positive(),
      "Voxels and OctoMap rays end at this distance from the camera; longer ranges still clear up to it.");
  VCHARGE_OPTION(double, free_weight, 1.0, positive(),
                 "Weight of a free voxel over that of an occupied one.");
  VCHARGE_OPTION(
      double, min_layer_weight_m, 0.2, positive(),
      "Sum of weights, times the voxel height, from which an occupied run over free space is the surface.");
  VCHARGE_OPTION(double, max_memory_gb, 4.0, positive(), "A grid that needs more memory is refused.");
  VCHARGE_END_OPTIONS();

  void checkFields() const;
};

/// Options of OctomapBuilder.
struct OctomapOptions {
  VCHARGE_BEGIN_OPTIONS(OctomapOptions);
  VCHARGE_OPTION(double, resolution_m, 0.1, positive(), "Side of the smallest voxel.");
  VCHARGE_OPTION(int, pixel_step, 2, atLeast(1),
                 "Step in rows and columns between the pixels whose rays are cast.");
  VCHARGE_END_OPTIONS();
};

/// Options of HeightMapper.
struct HeightMapOptions {
  VCHARGE_BEGIN_OPTIONS(HeightMapOptions);
  VCHARGE_OPTION_GROUP(RangeMapperOptions, range_maps, RangeMapperOptions::offline(),
                       "Range maps to be fused.");
  VCHARGE_OPTION(
      double, min_view_distance_m, 1.0, notNegative(),
      "Distance that a camera moves between two range maps that are fused; each counts for this path.");
  VCHARGE_OPTION_GROUP(HeightFusionOptions, fusion, {}, "Voxel grid and weights of the ranges.");
  VCHARGE_OPTION(
      double, label_gamma, 10.0, notNegative(),
      "Sum of weights that the free space above an observed cell must reach (gamma of the paper).");
  VCHARGE_OPTION_GROUP(DrivabilityOptions, drivability, {}, "Which cells can be driven on.");
  VCHARGE_OPTION_GROUP(OctomapOptions, octomap, {}, "OctoMap built from the same range maps.");
  VCHARGE_END_OPTIONS();
};

}  // namespace vcharge
