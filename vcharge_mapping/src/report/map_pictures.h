#pragma once

#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

// Pictures of a map as <svg> elements.

/// Path and landmarks from above; colours show the landmarks' heights.
std::string drawTopView(const SparseMap& map);
/// Loop edges on the path: accepted, and rejected by reason.
std::string drawLoops(const SparseMap& map);
/// Path, coloured by motion model.
std::string drawMotions(const ReconstructionState& state);
/// Height of the path over the driven distance, coloured by motion model.
std::string drawHeights(const ReconstructionState& state);
/// Number of visible landmarks over the driven distance, for all cameras and each camera.
std::string drawLandmarkCounts(const SparseMap& map);
/// Distribution of the reprojection errors by camera.
std::string drawErrors(const SparseMap& map);

/// Colour of a motion in the pictures.
std::string colourOf(MotionHypothesis motion);
/// Colour of a loop edge by the reason of its rejection; empty for accepted.
std::string colourOfReason(const std::string& reason);

}  // namespace vcharge
