#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/height_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// Options of evaluateHeightMap().
struct HeightMapErrorOptions {
  VCHARGE_BEGIN_OPTIONS(HeightMapErrorOptions);
  VCHARGE_OPTION(double, max_view_range_m, 8.0, positive(), "Distance up to which a camera sees a surface.");
  VCHARGE_OPTION(double, step_m, 0.08, positive(), "Change of the true height that is a step.");
  VCHARGE_OPTION(int, num_measurements, 20, notNegative(), "Number of tape-measure distances.");
  VCHARGE_OPTION(int, seed, 1, anyValue(), "Seed that selects these distances.");
  VCHARGE_END_OPTIONS();
};

/// Whether a point is on a rigid object with edges that a tape measure could be held to, not on a plant or
/// grass. Depends on the scene alone; `high_m`: the true height there.
using IsRigid = std::function<bool(const Eigen::Vector2d& point_m, double high_m)>;

/// IsRigid by the obstacles of the scene (obstacles.yaml). Excluded are points within 0.3 m of a tree, bush
/// or hedge, points in a tree's crown (over 0.3 m up, within 3.5 m of the stem, not on another object), and
/// on an island with a kerb all but the kerb itself.
IsRigid makeIsRigid(const std::vector<TruthObstacle>& obstacles);

/// A point where the true height jumps, crossed along an axis of the world from the low to the high side.
struct HeightStep {
  Eigen::Vector2d position_m{0, 0};  ///< the edge, in the world
  Eigen::Vector2d direction{1, 0};   ///< unit, upwards
  double low_m = 0.0, high_m = 0.0;  ///< true heights beside it
  bool both_sides_seen = false;      ///< whether the upper side is visible, too
  bool foot_seen = false;            ///< whether the foot of its face is visible from in front of the face
};

/// A distance that a tape measure could take in the world, and the map's value of it.
struct TapeMeasurement {
  enum class Kind { kLength, kHeight };
  Kind kind = Kind::kLength;
  Eigen::Vector2d from_m{0, 0}, to_m{0, 0};  ///< in the world; for a height, the points below and above
  double truth_m = 0.0;
  double map_m = 0.0;  ///< NaN if it cannot be read from the map
};

/// A point on a kerb in the map.
struct KerbError {
  Eigen::Vector2d position_m{0, 0};
  double error_m = 0.0;         ///< height in the map minus the true one
  double nearest_view_m = 0.0;  ///< distance of the nearest frame to which its top was visible
};

/// Errors of the drivable grid that a planner derives from the map.
struct DrivabilityErrors {
  size_t num_faces = 0;                ///< points on high rigid steps whose face was visible from the front
  size_t num_faces_blocked = 0;        ///< faces with an obstacle in the map within 0.1 m
  std::vector<HeightStep> open_faces;  ///< faces with neither an obstacle nor an unobserved cell there
  size_t num_drivable = 0;             ///< drivable cells of the map
  size_t num_drivable_inside = 0;      ///< drivable cells inside objects over 30 cm, by at least 0.1 m
  size_t num_open_ground = 0;          ///< visible cells on ground that is level for 0.2 m around
  size_t num_open_drivable = 0;        ///< those that are drivable in the map
  size_t num_solid = 0;                ///< cells marked as solid without a height
  size_t num_solid_on_ground = 0;      ///< those on ground that is level for 0.2 m around
};

struct HeightMapErrors {
  size_t num_seen = 0;         ///< cells away from steps whose true surface was visible often enough
  size_t num_mapped = 0;       ///< those that are observed in the map
  ErrorDistribution height_m;  ///< absolute errors
  double mean_signed_m = 0.0;
  double fraction_within_10_cm = 0.0;
  size_t num_steps = 0;         ///< points on steps whose lower side was visible often enough
  size_t num_steps_mapped = 0;  ///< those with heights on both sides in the map; only these are judged
  size_t num_steps_found = 0;   ///< those at which the map rises
  ErrorDistribution step_position_m;
  size_t num_kerbs_seen = 0;        ///< points on kerbs both of whose sides were visible often enough
  std::vector<KerbError> kerbs;     ///< those with heights on both sides in the map
  ErrorDistribution kerb_height_m;  ///< absolute errors of the height of kerbs
  std::vector<TapeMeasurement> measurements;
  double mean_measurement_m = 0.0, max_measurement_m = 0.0;  ///< absolute errors of those that the map shows
  size_t num_measurements_missing = 0;
  DrivabilityErrors drivability;
  cv::Mat error_m;  ///< CV_32FC1 of the map's size: map minus truth of the judged cells, NaN elsewhere
};

/// Aligns the map's trajectory with the true one by positions and headings, which also works for straight
/// drives. InputError if fewer than two poses have truth.
RigidTransform alignToTruth(const Trajectory& estimate, const Trajectory& truth);

/// Compares a height map with the true one, whose cells should be at most half as large.
/// `world_from_vehicle`: the true trajectory; `world_from_map`: see alignToTruth(); `is_rigid`: where
/// tape-measure distances may be taken.
HeightMapErrors evaluateHeightMap(const HeightMap& map, const RigidTransform& world_from_map,
                                  const HeightMap& truth, const Trajectory& world_from_vehicle,
                                  const CameraRig& rig, const IsRigid& is_rigid,
                                  const HeightMapErrorOptions& options = HeightMapErrorOptions());

}  // namespace vcharge
