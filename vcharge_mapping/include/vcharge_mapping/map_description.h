#pragma once

#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// Text for people about a map: what it holds, how large it is, how well it fits its observations, what
/// became of its loops, and where it comes from. `list_loop_edges` names every loop edge, not only their
/// counts.
std::string describeMap(const SparseMap& map, const MapProvenance& provenance, bool list_loop_edges = false);

/// Distances between the observations of a camera and the projections of their landmarks, in pixels.
/// `num_invisible` counts those that the camera model does not project.
struct ReprojectionErrors {
  size_t num_observations = 0;
  size_t num_invisible = 0;
  double rms_px = 0.0;
};
ReprojectionErrors measureReprojection(const SparseMap& map, size_t camera);

}  // namespace vcharge
