#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {

/// Options of the voxel weights (paper, section Height Map Fusion; Haene 2011). Heights count from the poses
/// of the vehicle: from the lowest and to the highest one.
struct HeightFusionOptions {
  double cell_size_m = 0.05;
  double height_step_m = 0.0125;     ///< height of a voxel; the smoothing takes steps down by up to one
  double min_height_m = -0.5;        ///< of the grid, from the lowest pose of the vehicle
  double max_height_m = 2.0;         ///< of the grid, from the highest pose; below a garage's ceiling
  double max_range_m = 8.0;          ///< voxels further from the camera are not touched, ranges may be longer
  double min_confidence = 0.5;       ///< ranges less sure are left out
  double max_relative_sigma = 0.08;  ///< ranges of a larger sigma over range are left out
  double band_m = 0.15;              ///< behind the surface, along the ray: occupied; free or unknown beyond
  double min_ramp_m = 0.01;          ///< the weight runs from free to occupied over sigma, no less than this
  double reference_sigma_m = 0.05;   ///< the weight of a range of this sigma is one half
  /// A range's weight grows with the log odds of its confidence and is 1 at this one (0: all alike).
  double reference_confidence = 0.9;
  /// The weight of a range whose pixel spans this much of the surface is one half (0: all alike). Far ground
  /// is seen at grazing angles: a matching window there covers both sides of a kerb.
  double reference_footprint_m = 0.15;
  double free_weight = 1.0;  ///< of free voxels over that of occupied ones
  /// What is occupied over free space, as a car's body over the ground under it, is the surface where its
  /// weights, times the height of a voxel, sum to this (0: one height parts what is occupied from what is
  /// free).
  double min_layer_weight_m = 0.2;
  /// A cell is solid where a run of voxels of this height and that weight is occupied, although nobody saw
  /// free space above it, as of walls and pillars, so that it has no height. None is without layers.
  double min_solid_height_m = 0.5;
  double max_memory_gb = 4.0;  ///< a grid that needs more is refused

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("cell_size_m", cell_size_m);
    visit("height_step_m", height_step_m);
    visit("min_height_m", min_height_m);
    visit("max_height_m", max_height_m);
    visit("max_range_m", max_range_m);
    visit("min_confidence", min_confidence);
    visit("max_relative_sigma", max_relative_sigma);
    visit("band_m", band_m);
    visit("min_ramp_m", min_ramp_m);
    visit("reference_sigma_m", reference_sigma_m);
    visit("reference_confidence", reference_confidence);
    visit("reference_footprint_m", reference_footprint_m);
    visit("free_weight", free_weight);
    visit("min_layer_weight_m", min_layer_weight_m);
    visit("min_solid_height_m", min_solid_height_m);
    visit("max_memory_gb", max_memory_gb);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// When the primal-dual iterations stop.
struct PrimalDualOptions {
  double max_gap_per_cell = 2e-4;  ///< duality gap over the number of cells, in the energy's unit
  int max_iterations = 4000;
  double step_ratio = 0.1;  ///< primal over dual step: about the distance that a value has to go

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_gap_per_cell", max_gap_per_cell);
    visit("max_iterations", max_iterations);
    visit("step_ratio", step_ratio);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Options of the two passes (paper, equations E^Labeling and E^Height). Gradients are differences between
/// neighbouring cells, so that lambda and epsilon are per cell.
struct HeightRegularizationOptions {
  double label_lambda = 0.1;  ///< lambda_l
  double label_gamma = 10.0;  ///< gamma: sum of weights that the free space of an observed cell must reach
  PrimalDualOptions label_solver = {1e-3, 4000, 1.0};
  double height_lambda = 2.0;  ///< lambda_h
  double alpha_up = 1.0;       ///< alpha_1: slope of the cost below the cell's best height
  double alpha_down = 1.0;     ///< alpha_2: above it
  /// 0: the data of all cells hold their height alike; 1: from either side as much as was seen there.
  double confidence_weighting = 1.0;
  double huber_epsilon_m = 0.002;
  PrimalDualOptions height_solver;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("label_lambda", label_lambda);
    visit("label_gamma", label_gamma);
    visit("label_solver", label_solver);
    visit("height_lambda", height_lambda);
    visit("alpha_up", alpha_up);
    visit("alpha_down", alpha_down);
    visit("confidence_weighting", confidence_weighting);
    visit("huber_epsilon_m", huber_epsilon_m);
    visit("height_solver", height_solver);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

struct OctomapOptions {
  double resolution_m = 0.1;
  double max_range_m = 8.0;  ///< longer rays clear up to here and end nowhere
  int pixel_step = 2;        ///< every how many rows and columns a ray is cast
  /// A range that is right less probably says nothing: an octree takes a hit for right with 0.7.
  double min_confidence = 0.7;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("resolution_m", resolution_m);
    visit("max_range_m", max_range_m);
    visit("pixel_step", pixel_step);
    visit("min_confidence", min_confidence);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

struct HeightMapOptions {
  RangeMapperOptions range_maps = RangeMapperOptions::offline();
  double min_view_distance_m = 0.3;  ///< of a camera between two range maps that are fused
  double min_covered_images = 0.9;   ///< share of the images that must have a pose
  HeightFusionOptions fusion;
  HeightRegularizationOptions regularization;
  DrivabilityOptions drivability;
  OctomapOptions octomap;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("range_maps", range_maps);
    visit("min_view_distance_m", min_view_distance_m);
    visit("min_covered_images", min_covered_images);
    visit("fusion", fusion);
    visit("regularization", regularization);
    visit("drivability", drivability);
    visit("octomap", octomap);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
