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

struct HeightMapErrorOptions {
  double view_distance_m = 0.3;  ///< travel between frames that count as views
  double max_view_range_m = 8.0;
  int min_views = 3;          ///< a cell is judged where its true surface is seen in as many frames
  double step_m = 0.08;       ///< a change of the true height within a cell that counts as a step
  double kerb_low_m = 0.1;    ///< steps of this height to
  double kerb_high_m = 0.14;  ///< this one are kerbs
  double search_m = 0.4;      ///< how far aside a step is looked for in the map
  double plateau_m = 0.15;    ///< heights beside a step are read this far from it
  int num_measurements = 20;  ///< tape-measure distances
  double min_length_m = 0.5;
  double max_length_m = 6.0;
  int seed = 1;  ///< picks the measurements

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("view_distance_m", view_distance_m);
    visit("max_view_range_m", max_view_range_m);
    visit("min_views", min_views);
    visit("step_m", step_m);
    visit("kerb_low_m", kerb_low_m);
    visit("kerb_high_m", kerb_high_m);
    visit("search_m", search_m);
    visit("plateau_m", plateau_m);
    visit("num_measurements", num_measurements);
    visit("min_length_m", min_length_m);
    visit("max_length_m", max_length_m);
    visit("seed", seed);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Whether a place is on something rigid, well enough defined for a tape measure (not a plant, not grass).
/// Told by the scene alone; `high_m`: the true height there.
using IsRigid = std::function<bool(const Eigen::Vector2d& place_m, double high_m)>;

/// From the obstacles of the scene (obstacles.yaml): not where a tree, bush or hedge stands within 0.3 m, not
/// in a tree's crown (over 0.3 m up, within 3.5 m of the stem, and not on a car or the like), and on an
/// island with a kerb only at the kerb's own height. All else is rigid: cars, walls, pillars, bins.
IsRigid rigidBy(const std::vector<TruthObstacle>& obstacles);

/// A place where the true height jumps, crossed along an axis of the world from its low to its high side.
struct HeightStep {
  Eigen::Vector2d place_m{0, 0};     ///< of the edge, in the world
  Eigen::Vector2d direction{1, 0};   ///< unit, upwards
  double low_m = 0.0, high_m = 0.0;  ///< true heights beside it
  bool both_sides_seen = false;      ///< the upper one, too
  bool foot_seen = false;            ///< that of its face, by cameras in front of the face
};

/// A distance that could be taken with a tape measure in the world, and is read from the map.
struct TapeMeasurement {
  enum class Kind { kLength, kHeight };
  Kind kind = Kind::kLength;
  Eigen::Vector2d from_m{0, 0}, to_m{0, 0};  ///< in the world; of a height, where it is read below and above
  double truth_m = 0.0;
  double map_m = 0.0;  ///< NaN: the map does not show it
};

/// How the map shows a place on a kerb.
struct KerbError {
  Eigen::Vector2d place_m{0, 0};
  double error_m = 0.0;         ///< height in the map less the true one
  double nearest_view_m = 0.0;  ///< distance of the nearest frame that saw its top
};

/// What a planner makes of the map's drivable cells.
struct DrivabilityErrors {
  size_t num_faces = 0;                ///< places on high rigid steps whose face was seen from in front
  size_t num_faces_blocked = 0;        ///< of these, the map has an obstacle within a hand
  std::vector<HeightStep> open_faces;  ///< of these, it has neither that there nor what is unobserved
  size_t num_drivable = 0;             ///< cells that the map calls drivable
  size_t num_drivable_inside = 0;      ///< of these, things of over 30 cm stand there and for a hand around
  size_t num_open_ground = 0;          ///< cells that are seen, on ground that is level for two hands around
  size_t num_open_drivable = 0;        ///< of these, the map calls them drivable
  size_t num_solid = 0;                ///< cells that stand without a height
  size_t num_solid_on_ground = 0;      ///< of these, the truth is ground that is level for two hands around
};

struct HeightMapErrors {
  size_t num_seen = 0;         ///< cells whose true surface is seen often enough, apart from steps
  size_t num_mapped = 0;       ///< of these, observed in the map
  ErrorDistribution height_m;  ///< absolute
  double mean_signed_m = 0.0;
  double share_within_10_cm = 0.0;
  size_t num_steps = 0;         ///< places on steps whose lower side is seen often enough
  size_t num_steps_mapped = 0;  ///< of these, with heights on both sides; the others are not judged
  size_t num_steps_found = 0;   ///< of these, the map rises there
  ErrorDistribution step_position_m;
  size_t num_kerbs_seen = 0;        ///< places on kerbs whose both sides are seen often enough
  std::vector<KerbError> kerbs;     ///< of these, with heights on both sides
  ErrorDistribution kerb_height_m;  ///< absolute errors of the height of kerbs
  std::vector<TapeMeasurement> measurements;
  double mean_measurement_m = 0.0, max_measurement_m = 0.0;  ///< absolute errors, of those the map shows
  size_t num_measurements_missing = 0;
  DrivabilityErrors drivability;
  cv::Mat error_m;  ///< CV_32FC1 of the map's size: estimate less truth of the judged cells, NaN elsewhere
};

/// Lays the map's trajectory over the true one by whole poses, so that a straight drive does, too.
/// InputError when fewer than two poses have truth.
RigidTransform alignToTruth(const Trajectory& estimate, const Trajectory& truth);

/// Judges a height map by the true one (cells no larger than half the map's give the steps' places well).
/// `world_from_vehicle` is the true trajectory; `world_from_map` see alignToTruth(); `is_rigid` tells between
/// which things tape-measure distances are taken.
HeightMapErrors evaluateHeightMap(const HeightMap& map, const RigidTransform& world_from_map,
                                  const HeightMap& truth, const Trajectory& world_from_vehicle,
                                  const CameraRig& rig, const IsRigid& is_rigid,
                                  const HeightMapErrorOptions& options = HeightMapErrorOptions());

}  // namespace vcharge
