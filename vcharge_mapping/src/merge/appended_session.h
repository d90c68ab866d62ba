#pragma once

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// A map followed by the sessions of another one, which become components of their own: beside the map, at a
/// distance at which no landmark is in view of both. Of loop edges only accepted ones are kept.
SparseMapContents appendSession(const SparseMap& map, const SparseMap& session);

/// Gives components that `joined` connects one number, that of the lowest session.
void joinComponents(const std::vector<std::pair<int32_t, int32_t>>& joined,
                    std::vector<MapSession>* sessions);

}  // namespace vcharge
