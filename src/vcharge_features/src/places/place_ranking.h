#pragma once

#include <algorithm>
#include <vector>

#include "vcharge_features/place_index.h"

namespace vcharge {

/// Keeps at most `max_results` places with a positive score, best first, ties in their order.
inline void keepBest(int max_results, std::vector<PlaceMatch>* places) {
  std::vector<PlaceMatch>& matches = *places;
  matches.erase(std::remove_if(matches.begin(), matches.end(),
                               [](const PlaceMatch& match) { return !(match.score > 0.0); }),
                matches.end());
  std::stable_sort(matches.begin(), matches.end(),
                   [](const PlaceMatch& a, const PlaceMatch& b) { return a.score > b.score; });
  matches.resize(std::min(matches.size(), static_cast<size_t>(std::max(max_results, 0))));
}

}  // namespace vcharge
