#pragma once

#include <memory>
#include <string>

#include "vcharge_core/base/options.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/bundle_adjustment.h"
#include "vcharge_reconstruction/landmarks/landmark_search.h"
#include "vcharge_reconstruction/loop_closure.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {

/// Options of mergeSession().
struct MergeOptions {
  VCHARGE_BEGIN_OPTIONS(MergeOptions);
  VCHARGE_OPTION_GROUP(LoopClosureOptions, loops, {}, "Common places of map and session.");
  VCHARGE_OPTION_GROUP(LandmarkSearchOptions, search, {}, "Search for landmarks that both have.");
  VCHARGE_OPTION_GROUP(BundleAdjustmentOptions, bundle, {}, "Adjustment of all sessions together.");
  VCHARGE_OPTION(double, min_common_over_chance, 3.0, notNegative(),
                 "Least common landmarks where they meet, over those that a wrong pose gives.");
  VCHARGE_END_OPTIONS();
};

/// How map and session fit.
struct MergeReport {
  bool joined = false;
  int num_accepted_loops = 0;   ///< between map and session
  int num_undecided_loops = 0;  ///< neither confirmed nor contradicted
  int num_rejected_loops = 0;   ///< contradicted, or of too few matches
  /// Part of the session's observations, where it passes keyframes of the map, whose landmark both have.
  double common_ratio = 0.0;
  double chance_ratio = 0.0;  ///< the same if each pose of the session is turned around, which is wrong
  double rms_px = 0.0;        ///< of all observations after the adjustment
  std::string remark;         ///< why they were not joined; empty if they were
};

/// A map with the sessions of another one.
struct MergedMap {
  std::shared_ptr<const SparseMap> map;
  MergeReport report;
};

/// InputError, which begins with `name`, unless the session has the map's rig and features. Extrinsics that
/// were calibrated anew may differ by a little; the map's stay valid.
void requireSameRig(const SparseMap& map, const SparseMap& session, const std::string& name);

/// Adds the sessions of a map to another map: common places are found by their images and verified by
/// geometry; loops between the two are believed in groups (optimizeRobustly()); where they meet, both must
/// have more landmarks in common than chance gives; then all sessions are adjusted together, with fixed rig.
/// Without common places the session becomes a component of its own beside the others. Ids of the map stay;
/// those of the session are assigned anew. Data parallel, deterministic. InputError as requireSameRig().
MergedMap mergeSession(const SparseMap& map, const SparseMap& session, const MergeOptions& options,
                       const StageCallback& progress);

}  // namespace vcharge
