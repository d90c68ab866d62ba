#pragma once

#include <string>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

enum class MapGrade { kGood, kCheck, kBad };

/// Assessment of a map with its reasons.
struct MapVerdict {
  MapGrade grade = MapGrade::kGood;
  std::vector<std::string> remarks;
};
std::string toString(MapGrade grade);  ///< "GOOD", "CHECK", "BAD"

/// Assesses a map without ground truth: landmarks per keyframe, reprojection error, loops, motion models, the
/// odometer's factors, and skipped frames. `state` is the mapper's state after finish().
MapVerdict judgeMap(const SparseMap& map, const ReconstructionState& state);

/// A self-contained HTML page: verdict, path and landmarks from above, loop edges, motion along the drive,
/// number of visible landmarks, errors by camera, times by stage, skipped frames.
std::string makeMapReport(const std::string& title, const SparseMap& map, const ReconstructionState& state);

}  // namespace vcharge
