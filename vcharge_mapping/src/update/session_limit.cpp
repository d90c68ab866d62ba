#include "vcharge_mapping/session_limit.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "update/reduced_map.h"
#include "update/same_place.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Decides which keyframes a map needs: those of a limited number of sessions at each place.
class PlaceKeeper {
 public:
  PlaceKeeper(const SparseMap& map, int max_sessions_per_place)
      : map_(map),
        max_sessions_per_place_(max_sessions_per_place),
        newest_(static_cast<int32_t>(map.sessions().size()) - 1),
        is_in_newest_(map.landmarks().size(), false) {
    for (const MapObservation& observation : map.observations()) {
      if (map.keyframes()[observation.keyframe].session == newest_) {
        is_in_newest_[observation.landmark] = true;
      }
    }
  }

  std::vector<bool> neededKeyframes() const {
    std::vector<bool> needed(map_.keyframes().size(), true);
    for (size_t i = 0; i < needed.size(); ++i) {
      needed[i] = isNeeded(i);
    }
    return needed;
  }

 private:
  /// Landmarks that a session's keyframes observe at a place, and how many of them the newest session saw.
  struct Coverage {
    int64_t num_landmarks = 0, num_in_newest = 0;
    double ratio() const {
      return static_cast<double>(num_in_newest) / static_cast<double>(std::max<int64_t>(1, num_landmarks));
    }
  };

  std::map<int32_t, Coverage> coverageAt(const MapKeyframe& place) const {
    std::map<int32_t, Coverage> coverage;
    for (size_t k = 0; k < map_.keyframes().size(); ++k) {
      const MapKeyframe& keyframe = map_.keyframes()[k];
      if (!isAtPlace(place, keyframe)) {
        continue;
      }
      Coverage& of_session = coverage[keyframe.session];
      const auto begin = map_.observationsOf(k, 0).first;
      const auto end = map_.observationsOf(k, map_.rig().cameras.size() - 1).second;
      for (size_t i = begin; i < end; ++i) {
        ++of_session.num_landmarks;
        of_session.num_in_newest += is_in_newest_[map_.observations()[i].landmark] ? 1 : 0;
      }
    }
    return coverage;
  }

  /// The newest session stays, and of the others at a place those that it resembles least: the map keeps
  /// different light rather than the same light twice.
  bool isNeeded(size_t index) const {
    const MapKeyframe& keyframe = map_.keyframes()[index];
    if (keyframe.session == newest_) {
      return true;
    }
    std::map<int32_t, Coverage> coverage = coverageAt(keyframe);
    const bool has_newest = coverage.erase(newest_) > 0;
    const auto num_kept = static_cast<size_t>(max_sessions_per_place_ - (has_newest ? 1 : 0));
    if (coverage.size() <= num_kept) {
      return true;
    }
    const double own = coverage.at(keyframe.session).ratio();
    // If two are equal, the later session stays.
    const auto num_better = std::count_if(coverage.begin(), coverage.end(), [&](const auto& other) {
      return other.second.ratio() < own || (other.second.ratio() == own && other.first > keyframe.session);
    });
    return static_cast<size_t>(num_better) < num_kept;
  }

  const SparseMap& map_;
  const int max_sessions_per_place_;
  const int32_t newest_;
  std::vector<bool> is_in_newest_;
};

}  // namespace

std::shared_ptr<const SparseMap> limitSessionsPerPlace(const std::shared_ptr<const SparseMap>& map,
                                                       int max_sessions_per_place) {
  check(max_sessions_per_place >= 1, "limitSessionsPerPlace: expected at least one session");
  const std::vector<bool> needed = PlaceKeeper(*map, max_sessions_per_place).neededKeyframes();
  if (std::find(needed.begin(), needed.end(), false) == needed.end()) {
    return map;
  }
  return reducedMap(*map, needed, std::vector<bool>(map->landmarks().size(), true));
}

}  // namespace vcharge
