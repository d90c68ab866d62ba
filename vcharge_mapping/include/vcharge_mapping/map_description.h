#pragma once

#include <string>

#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {

/// A readable description of a map: size, reprojection errors, loops and provenance. `list_loop_edges`:
/// lists every loop edge in addition to their counts.
std::string describeMap(const SparseMap& map, const MapProvenance& provenance, bool list_loop_edges = false);

/// Length of the drives in a map.
double lengthOf_m(const SparseMap& map);

/// Distances between the observations of a camera and the projections of their landmarks. `num_invisible`
/// counts landmarks that the camera model does not project.
struct ReprojectionErrors {
  size_t num_observations = 0;
  size_t num_invisible = 0;
  double rms_px = 0.0;
};
ReprojectionErrors measureReprojection(const SparseMap& map, size_t camera);

}  // namespace vcharge
