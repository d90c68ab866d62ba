#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// What a session tells about a landmark of earlier sessions.
struct PresenceEvidence {
  bool is_seen = false;
  int num_missed = 0;  ///< views in which it should have been found
  /// Logarithm of the likelihood ratio of "still there" over "gone"; 0 where the session tells nothing.
  double log_odds = 0.0;
};

/// Weighs the evidence of a session, by its index, for every landmark. A landmark is expected in an image
/// where an earlier drive observed it from nearly the same direction and distance. An image counts as much as
/// it can tell: where it shows few of the expected landmarks (at night, or wet), a missing one means little.
/// A landmark behind a nearer one that the image shows is occluded, which is no evidence.
std::vector<PresenceEvidence> weighPresence(const SparseMap& map, int32_t session);

}  // namespace vcharge
