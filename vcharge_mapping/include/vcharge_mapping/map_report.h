#pragma once

#include <string>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

enum class MapGrade { kGood, kCheck, kBad };

/// Whether a map may be used, and what there is to say about it.
struct MapVerdict {
  MapGrade grade = MapGrade::kGood;
  std::vector<std::string> remarks;  ///< the reasons, in no order
};
std::string toString(MapGrade grade);  ///< "GOOD", "CHECK", "BAD"

/// Judges by what mapping itself knows, without truth: landmarks that every place needs to be recognized by,
/// the error of reprojection for the images' size, loops, how the vehicle was taken to move, the odometer's
/// factors, and what was skipped. `state` is that after the map was made.
MapVerdict judgeMap(const SparseMap& map, const MappingState& state);

/// A page of HTML that needs nothing beside it: verdict, path and landmarks from above, loop edges with what
/// became of them, how the vehicle moved along the drive, landmarks in view, errors by camera, stages and
/// their times, what was skipped.
std::string makeMapReport(const std::string& title, const SparseMap& map, const MappingState& state);

}  // namespace vcharge
