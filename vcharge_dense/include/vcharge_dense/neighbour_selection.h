#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// A shorter baseline shows too little parallax.
constexpr double kMinBaseline_m = 0.08;

/// Options of neighbour selection. Baselines are distances between camera positions.
struct NeighbourOptions {
  VCHARGE_BEGIN_OPTIONS(NeighbourOptions);
  VCHARGE_OPTION(int, num_neighbours, 4, between(1, 32),
                 "Neighbours of a reference, half of them on each side where later images are used.");
  VCHARGE_OPTION(double, max_baseline_m, 0.8, between(kMinBaseline_m, 100.0),
                 "Longest baseline of a camera that looks across the direction of travel.");
  VCHARGE_OPTION(double, max_forward_baseline_m, 0.8, between(kMinBaseline_m, 100.0),
                 "Longest baseline of a camera that looks along it; longer ones lose the ground nearby.");
  VCHARGE_END_OPTIONS();

  void checkFields() const;
};

/// Longest baseline for a camera with this optical axis and direction of travel (unit vectors in one frame).
double longestBaseline(const NeighbourOptions& options, const Eigen::Vector3d& optical_axis,
                       const Eigen::Vector3d& travel_direction);

/// Selects up to `count` candidates on one side of the reference whose baselines are closest to `count` equal
/// steps up to `longest_m`. Baselines below kMinBaseline_m or above 1.25 longest_m are left out. Returns
/// ascending indices into `baselines_m`.
std::vector<size_t> selectNeighbours(const std::vector<double>& baselines_m, int count, double longest_m);

}  // namespace vcharge
