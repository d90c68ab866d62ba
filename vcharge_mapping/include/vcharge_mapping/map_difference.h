#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// A landmark that only one of two versions has, or that moved between them.
struct LandmarkChange {
  enum class Kind { kAppeared, kVanished, kMoved };
  Kind kind = Kind::kAppeared;
  int32_t id = kNoId;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the later version, if it has the landmark
  double moved_by_m = 0.0;
};

/// What changed from one version of a map to another.
struct MapDifference {
  std::vector<std::string> new_sessions, lost_sessions;  ///< names
  size_t num_new_keyframes = 0, num_lost_keyframes = 0;
  size_t num_common_landmarks = 0;
  std::vector<LandmarkChange> landmarks;  ///< by id
  double median_move_m = 0.0;             ///< of all common landmarks

  size_t count(LandmarkChange::Kind kind) const;
};

/// Compares two versions of one map, by the ids of their records. Landmarks that moved by no more than
/// `min_move_m` count as unchanged: an adjustment moves all of them a little.
MapDifference compareVersions(const SparseMap& from, const SparseMap& to, double min_move_m);

/// The changed landmarks as comma separated values: change, id, x_m, y_m, z_m, moved_by_m.
std::string toCsv(const MapDifference& difference);

}  // namespace vcharge
