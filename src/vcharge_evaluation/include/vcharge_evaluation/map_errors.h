#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/trajectory_errors.h"

namespace vcharge {

struct MapErrorOptions {
  double max_edge_error_m = 0.3;           ///< a loop edge that is further off is wrong
  double max_edge_error_rad = 0.05235988;  ///< and one that is turned by more: 3 degrees
  double revisit_distance_m = 3.0;  ///< a place is visited again when the vehicle comes this near to it
  double min_travel_m = 10.0;       ///< after driving on by more than this
  double opposite_rad = 2.0943951;  ///< headings that differ by more are opposite: 120 degrees

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_edge_error_m", max_edge_error_m);
    visit("max_edge_error_rad", max_edge_error_rad);
    visit("revisit_distance_m", revisit_distance_m);
    visit("min_travel_m", min_travel_m);
    visit("opposite_rad", opposite_rad);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What is true of one of the map's loop edges.
struct LoopEdgeJudgement {
  bool has_truth = false;    ///< at both keyframes; nothing below is meant where it is false
  bool is_opposite = false;  ///< the true headings
  double distance_m = 0.0;   ///< between the true places
  double error_m = 0.0;      ///< of the measured transform against the true one
  double error_rad = 0.0;
  bool is_right = false;
};

/// Keyframes that came to a place again.
struct RevisitCount {
  int64_t num_keyframes = 0;
  int64_t num_found = 0;  ///< of these: the later end of an accepted right edge

  double share() const {
    return num_keyframes == 0 ? 0.0 : static_cast<double>(num_found) / static_cast<double>(num_keyframes);
  }
};

struct RejectedEdges {
  int64_t num_edges = 0;
  int64_t num_right = 0;  ///< the measured transform is right all the same
};

struct MapErrors {
  TrajectoryErrors keyframes;  ///< aligned over all keyframes by a rigid motion
  double scale_error = 0.0;    ///< of similarity: 0.01 where the map is 1 % too large
  RigidTransform truth_from_map;
  int64_t num_keyframes_without_truth = 0;

  std::vector<LoopEdgeJudgement> edges;  ///< in the map's order
  int64_t num_accepted = 0;              ///< with truth
  int64_t num_wrong = 0;                 ///< of these
  ErrorDistribution accepted_m, accepted_rad;
  std::map<std::string, RejectedEdges> rejected;  ///< by reason

  std::vector<bool> is_revisit, is_found;  ///< by keyframe
  RevisitCount revisits;                   ///< in any heading
  /// Places passed before in this heading, that got a right edge of this kind; a keyframe may count in both.
  RevisitCount same, opposite;
  /// Places passed before in the opposite heading alone, that got any right edge.
  RevisitCount only_opposite;
};

/// Judges a map's keyframes and loop edges by the true trajectory, which is interpolated to the keyframes'
/// stamps. InputError when fewer than three keyframes have truth.
MapErrors evaluateMap(const SparseMap& map, const Trajectory& truth,
                      const MapErrorOptions& options = MapErrorOptions());

}  // namespace vcharge
