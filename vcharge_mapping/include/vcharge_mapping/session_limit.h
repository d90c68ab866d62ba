#pragma once

#include <memory>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// The map without some keyframes of places that many drives passed, so that it grows with the area and not
/// with the number of drives. The newest session stays whole; of the others at a place, those stay whose
/// landmarks it saw least: another light is kept rather than the same one twice. Landmarks that only removed
/// keyframes observe, and sessions without keyframes, leave as well. Returns the same map if nothing leaves.
std::shared_ptr<const SparseMap> limitSessionsPerPlace(const std::shared_ptr<const SparseMap>& map,
                                                       int max_sessions_per_place);

}  // namespace vcharge
