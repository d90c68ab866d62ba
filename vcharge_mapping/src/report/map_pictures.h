#pragma once

#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

// Pictures of a map as <svg> elements.

/// Path and landmarks from above, by height.
std::string drawTopView(const SparseMap& map);
/// Loop edges on the path: accepted, and rejected by reason.
std::string drawLoops(const SparseMap& map);
/// Path coloured by how the vehicle was taken to move.
std::string drawMotions(const MappingState& state);
/// Height of the path over the way, on the same colours.
std::string drawHeights(const MappingState& state);
/// Landmarks in view at each keyframe over the way, all cameras and each.
std::string drawLandmarkCounts(const SparseMap& map);
/// Distribution of the reprojection errors by camera.
std::string drawErrors(const SparseMap& map);

/// Colour of a motion in the pictures.
std::string colourOf(MotionHypothesis motion);
/// Of a loop edge's reason for a rejection; empty for accepted.
std::string colourOfReason(const std::string& reason);

}  // namespace vcharge
