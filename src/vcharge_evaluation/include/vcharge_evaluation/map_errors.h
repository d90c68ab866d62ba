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

/// Options of evaluateMap().
struct MapErrorOptions {
  VCHARGE_BEGIN_OPTIONS(MapErrorOptions);
  VCHARGE_OPTION(double, opposite_rad, 2.0943951, above(0.0).below(3.14159265358979),
                 "Difference above which two headings are opposite.");
  VCHARGE_END_OPTIONS();
};

/// One of the map's loop edges against the truth.
struct LoopEdgeJudgement {
  bool has_truth = false;    ///< whether both keyframes have truth; if not, the other members are not set
  bool is_opposite = false;  ///< whether the true headings are opposite
  double distance_m = 0.0;   ///< distance between the true positions
  double error_m = 0.0;      ///< translation error of the measured transform
  double error_rad = 0.0;
  bool is_right = false;  ///< both errors are within the bounds
};

/// Keyframes at a position that was passed before.
struct RevisitCount {
  int num_keyframes = 0;
  int num_found = 0;  ///< those that are the later end of an accepted correct edge

  double fraction() const {
    return num_keyframes == 0 ? 0.0 : static_cast<double>(num_found) / static_cast<double>(num_keyframes);
  }
};

struct RejectedEdges {
  int num_edges = 0;
  int num_right = 0;  ///< edges whose measured transform is correct
};

struct MapErrors {
  TrajectoryErrors keyframes;  ///< aligned over all keyframes by a rigid transform
  double scale_error = 0.0;    ///< 0.01 if the map is 1 % too large
  RigidTransform truth_from_map;
  int num_keyframes_without_truth = 0;

  std::vector<LoopEdgeJudgement> edges;  ///< in the map's order
  int num_accepted = 0;                  ///< accepted edges with truth
  int num_wrong = 0;                     ///< accepted edges that are not correct
  ErrorDistribution accepted_m, accepted_rad;
  std::map<std::string, RejectedEdges> rejected;  ///< key: reason

  std::vector<bool> is_revisit, is_found;  ///< one per keyframe
  RevisitCount revisits;                   ///< revisits in any heading
  /// Keyframes passed before in the same or opposite heading, with an edge of that kind; one may count in
  /// both.
  RevisitCount same, opposite;
  /// Keyframes passed before in the opposite heading only, with any correct edge.
  RevisitCount only_opposite;
};

/// Compares a map's keyframes and loop edges with the true trajectory, interpolated to the keyframes' stamps.
/// InputError if fewer than three keyframes have truth.
MapErrors evaluateMap(const SparseMap& map, const Trajectory& truth,
                      const MapErrorOptions& options = MapErrorOptions());

}  // namespace vcharge
