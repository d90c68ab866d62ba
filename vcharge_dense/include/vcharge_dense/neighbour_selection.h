#pragma once

#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Which images around the reference it is matched with. Baselines are distances between camera positions.
struct NeighbourOptions {
  int num_neighbours = 4;        ///< half of them on each side where later images are used, too
  double min_baseline_m = 0.08;  ///< nearer ones show too little parallax
  double max_baseline_m = 0.8;   ///< of a camera that looks across the direction of travel
  /// Of a camera that looks along it. Longer ones measure far points better, but the ground nearby then
  /// changes its scale too much between the images to be matched.
  double max_forward_baseline_m = 0.8;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("num_neighbours", num_neighbours);
    visit("min_baseline_m", min_baseline_m);
    visit("max_baseline_m", max_baseline_m);
    visit("max_forward_baseline_m", max_forward_baseline_m);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Longest baseline for a camera whose optical axis and direction of travel (both unit, in one frame) are
/// given.
double longestBaseline(const NeighbourOptions& options, const Eigen::Vector3d& optical_axis,
                       const Eigen::Vector3d& travel_direction);

/// Up to `count` of the candidates on one side of the reference, so that their baselines come closest to
/// count equal steps up to `longest_m`; none nearer than min_baseline_m or much further than longest_m.
/// Ascending indices.
std::vector<size_t> selectNeighbours(const NeighbourOptions& options, const std::vector<double>& baselines_m,
                                     int count, double longest_m);

}  // namespace vcharge
