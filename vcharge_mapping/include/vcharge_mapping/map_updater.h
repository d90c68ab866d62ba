#pragma once

#include <cstdint>
#include <memory>

#include "vcharge_core/base/options.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_mapping/session_merger.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {

/// Options of updateMap().
struct UpdateOptions {
  VCHARGE_BEGIN_OPTIONS(UpdateOptions);
  VCHARGE_OPTION_GROUP(MergeOptions, merge, {}, "Joining of map and drive.");
  VCHARGE_OPTION(int, max_sessions_per_place, 2, atLeast(1), "Drives that a map keeps of a place.");
  VCHARGE_END_OPTIONS();
};

/// What a drive changed.
struct UpdateReport {
  MergeReport merge;
  int64_t num_seen_landmarks = 0;       ///< landmarks of the map that the drive saw again
  int64_t num_missed_landmarks = 0;     ///< landmarks that it should have seen and did not
  int64_t num_removed_landmarks = 0;    ///< landmarks that several drives missed
  int64_t num_new_landmarks = 0;        ///< landmarks that only this drive saw
  int64_t num_removed_keyframes = 0;    ///< keyframes at places that later drives show as well
  int64_t num_forgotten_landmarks = 0;  ///< landmarks that only those keyframes saw
};

struct UpdatedMap {
  std::shared_ptr<const SparseMap> map;
  UpdateReport report;
};

/// Changes a map by a drive of another day, given as its map: joins it (mergeSession()), weighs for each
/// landmark whether the drive saw it where it should have, removes landmarks that several drives missed, and
/// keeps only so many drives of a place, so that the map does not grow with the number of drives. InputError
/// if the two have no common places.
UpdatedMap updateMap(const SparseMap& map, const SparseMap& session, const UpdateOptions& options,
                     const StageCallback& progress);

}  // namespace vcharge
