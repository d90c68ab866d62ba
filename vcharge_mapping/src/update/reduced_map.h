#pragma once

#include <memory>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// The map without some keyframes and landmarks. Landmarks that no remaining keyframe observes, and sessions
/// without keyframes, are left out as well.
std::shared_ptr<const SparseMap> reducedMap(const SparseMap& map, const std::vector<bool>& keeps_keyframe,
                                            const std::vector<bool>& keeps_landmark);

}  // namespace vcharge
