#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/obstacle_truth.h"
#include "vcharge_evaluation/outlines.h"

namespace vcharge {

/// Options of ApproachEvaluator. The outline of the vehicle is that of the simulated car.
struct ApproachEvaluationOptions {
  VCHARGE_BEGIN_OPTIONS(ApproachEvaluationOptions);
  VCHARGE_OPTION(double, corridor_m, 5.0, positive(), "Length of the driving corridor ahead.");
  VCHARGE_OPTION(double, margin_m, 0.3, notNegative(), "Width of the corridor beside the vehicle's sides.");
  VCHARGE_OPTION(double, min_height_m, 0.2, positive(), "Least height of a judged obstacle.");
  VCHARGE_OPTION(double, max_gap_m, 1.0, notNegative(),
                 "Largest distance of a judged obstacle from the ground that is driven over.");
  VCHARGE_END_OPTIONS();
};

/// How early an obstacle was reported.
struct FirstReport {
  std::string kind;
  bool moves = false;
  double first_visible_m = 0.0;      ///< distance from the vehicle's outline when a camera first saw it
  double nearest_m = 0.0;            ///< least distance while it was visible or reported
  std::optional<double> reported_m;  ///< least distance until it was first reported; absent: never
  std::optional<double> contact_s;   ///< the same divided by the vehicle's speed; absent also at standstill
};

/// Cells of the driving corridor over all maps, by the truth and by what the map says.
struct CorridorCounts {
  size_t free_as_free = 0, free_as_unknown = 0, free_as_occupied = 0;
  size_t occupied_as_free = 0, occupied_as_unknown = 0, occupied_as_occupied = 0;

  void add(bool is_occupied, int8_t state);  ///< one cell: the truth, and its state in the map
};

struct ApproachErrors {
  std::vector<FirstReport> reports;
  CorridorCounts corridor;
  /// Ground that the vehicle drives over next, and has driven over last, 0.5 to 4 m from its outline, without
  /// margin, once it has driven 2 m.
  CorridorCounts ahead, behind;
  double driven_m = 0.0;
  double duration_s = 0.0;
  size_t num_false_alarms = 0;  ///< times that open ground in the corridor turned occupied
};

/// Judges the fused maps of one drive as a driver would: how early obstacles near the path are reported, and
/// whether the corridor that the vehicle is about to drive through is free, unknown or blocked. Obstacles
/// that are never reported count as reported at contact.
class ApproachEvaluator {
 public:
  /// `path`: true poses over the whole drive. The scene's ground must be level at z = 0.
  ApproachEvaluator(const std::vector<TruthObstacle>& obstacles, const TruthHeights& heights, Trajectory path,
                    const ApproachEvaluationOptions& options = {});

  /// Maps in order of time. `movers`: moving objects at this time, in the same order for every map.
  void add(const ObstacleMap& map, const std::vector<SeenPoint>& points,
           const RigidTransform& world_from_vehicle, const std::vector<TruthObstacle>& movers);

  ApproachErrors errors() const;
  /// Whether the vehicle has driven 2 m: before, stereo of single cameras has measured little or nothing.
  bool hasDriven() const;

 private:
  struct Frame;
  struct Corridor;

  void judgeObstacle(const Frame& frame, const TruthObstacle& obstacle, int key);
  /// The next (or with is_forward false, the last) part of the path from a stamp on.
  Corridor corridorFrom(Timestamp stamp, bool is_forward, double length_m, double margin_m) const;
  void judgeCorridor(const Frame& frame, const std::vector<TruthObstacle>& movers);
  /// Whether a cell is occupied; absent at the edges of obstacles.
  std::optional<bool> truthAt(const Eigen::Vector2d& world_m, const std::vector<TruthObstacle>& movers) const;
  Outline outline(const RigidTransform& world_from_vehicle, double margin_m) const;

  const ApproachEvaluationOptions options_;
  const TruthHeights heights_;
  const Trajectory path_;
  cv::Mat highest_around_;
  std::vector<TruthObstacle> standing_;
  std::map<int, FirstReport> reports_;  // key: index of a standing obstacle, or -1 - index of a mover
  std::map<int64_t, bool> was_alarm_;   // key: cell of the map's fixed frame
  std::optional<Timestamp> first_, last_;
  std::optional<Eigen::Vector2d> last_position_m_;
  ApproachErrors sums_;
};

}  // namespace vcharge
