#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_obstacles/obstacle_detector.h"
#include "vcharge_obstacles/scrolling_grid.h"

namespace vcharge {

class CellLooker;
class GroundShadows;

/// Options of LocalObstacleMap.
struct LocalObstacleMapOptions {
  double cell_size_m = 0.1;
  double half_size_m = 10.0;       ///< the map reaches so far from the vehicle, along both axes
  double free_range_m = 7.0;       ///< from the camera; ground further away is not cleared
  double occupied_range_m = 9.0;   ///< from the camera; obstacles further away are too uncertain
  double occupied_log_odds = 0.9;  ///< of a look with full support whose sigma is small to the cell
  /// Looks with a larger sigma count for less, by its square: many of them, which err together, would else
  /// mark ground that the obstacle is far from.
  double sharp_sigma_m = 0.12;
  double free_log_odds = 0.6;      ///< of a look at which all of the cell's pixels lie on the ground
  double min_free_share = 0.4;     ///< of a cell's pixels that lie on the ground, for any evidence
  double min_hidden_share = 0.5;   ///< of a cell's pixels that show something else, to doubt that it is free
  double doubt = 0.5;              ///< what such a look leaves of the log-odds of a free cell
  double unknown_doubt = 0.7;      ///< and one that shows nothing, aside of the direction of travel
  double min_changed_share = 0.4;  ///< of a cell's pixels that look otherwise than before, to take it back
  double changed_margin_m = 0.4;   ///< around such cells nothing is free: who moves is wider than his feet
  double changed_hold_s = 0.3;     ///< and for so long nothing becomes free
  /// Ground behind what was seen as an obstacle no longer ago is no evidence, whatever a camera says of it:
  /// under the body of a car the ground shows. 0: it is.
  double shadow_s = 0.13;
  double blind_angle_rad = 0.35;  ///< so near to the direction of travel nothing is to be expected
  /// Of a camera's motion across its ray to an obstacle, relative to the motion along it: an error of the
  /// range where stereo sees little parallax.
  double parallax_sigma = 0.005;
  double look_distance_m = 0.1;     ///< looks of a camera that moved less share their errors: weigh less
  double occupied_threshold = 1.5;  ///< log-odds from which on a cell is occupied
  double free_threshold = -1.0;     ///< and up to which it is free
  double max_log_odds = 3.5;        ///< bounds keep the map able to change its mind
  double min_log_odds = -2.5;
  double forget_occupied_m = 15.0;  ///< travel after which log-odds have fallen to 1/e
  double forget_free_m = 4.0;
  double odometry_sigma_m_per_m = 0.01;  ///< drift of the fixed frame, per metre of travel
  double scan_depth_m =
      0.2;  ///< cells so far behind the first one take part in its range; not those of kerbs
  int scan_rays = 360;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("cell_size_m", cell_size_m);
    visit("half_size_m", half_size_m);
    visit("free_range_m", free_range_m);
    visit("occupied_range_m", occupied_range_m);
    visit("occupied_log_odds", occupied_log_odds);
    visit("sharp_sigma_m", sharp_sigma_m);
    visit("free_log_odds", free_log_odds);
    visit("min_free_share", min_free_share);
    visit("min_hidden_share", min_hidden_share);
    visit("doubt", doubt);
    visit("unknown_doubt", unknown_doubt);
    visit("min_changed_share", min_changed_share);
    visit("changed_margin_m", changed_margin_m);
    visit("changed_hold_s", changed_hold_s);
    visit("shadow_s", shadow_s);
    visit("blind_angle_rad", blind_angle_rad);
    visit("parallax_sigma", parallax_sigma);
    visit("look_distance_m", look_distance_m);
    visit("occupied_threshold", occupied_threshold);
    visit("free_threshold", free_threshold);
    visit("max_log_odds", max_log_odds);
    visit("min_log_odds", min_log_odds);
    visit("forget_occupied_m", forget_occupied_m);
    visit("forget_free_m", forget_free_m);
    visit("odometry_sigma_m_per_m", odometry_sigma_m_per_m);
    visit("scan_depth_m", scan_depth_m);
    visit("scan_rays", scan_rays);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Obstacles and bare ground around the vehicle, fused over time and cameras in a grid of a fixed frame that
/// scrolls with the vehicle. Log-odds per cell; a cell's state changes by evidence alone, and what is not
/// seen again is forgotten with the distance driven, never with time: while the vehicle stands, motion stereo
/// sees nothing, and everything keeps its state and grows older.
///
/// Deterministic; not thread safe.
class LocalObstacleMap {
 public:
  explicit LocalObstacleMap(const LocalObstacleMapOptions& options = LocalObstacleMapOptions());

  /// Where the vehicle is from now on: scrolls, and forgets by the distance driven. Of the pose, x, y and
  /// yaw are used.
  void moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle);
  /// Adds what a camera saw from a pose; moveTo() comes first. `grid` is its detector's.
  void add(const CameraObstacles& seen, const PolarGrid& grid, const RigidTransform& fixed_from_vehicle);
  /// The fixed frame has moved: every cell finds its new place.
  void reanchor(const RigidTransform& new_from_old_fixed);
  /// All cells are unobserved again.
  void clear();

  /// As it is at the last moveTo(); frame_id is left empty.
  ObstacleMap snapshot() const;
  /// Nearest obstacle per direction, from the vehicle frame's origin; how far all is free in it.
  ObstacleScan scan() const;

  const LocalObstacleMapOptions& options() const { return options_; }

 private:
  struct Cell {
    float log_odds = 0.0F;
    float weight = 0.0F;  // of the looks in the sums below
    float x_m = 0.0F;     // mean place of the obstacle, from the cell's corner
    float y_m = 0.0F;
    float sigma_m = 0.0F;
    float height_m = 0.0F;
    float height_sigma_m = 0.0F;
    float travel_m = 0.0F;          // distance driven when it was last seen
    int64_t last_seen_ns = kNever;  // INT64_MIN: never
    int64_t last_occupied_ns = kNever;
    int64_t held_until_ns = kNever;  // not free before
  };
  /// What a camera says about the ground of one cell.
  struct GroundLook;
  /// A look at an obstacle, in the fixed frame.
  struct Look {
    Eigen::Vector2d point_m;
    double mass;
    double sigma_m;  // along the ray
    const PolarObstacle* obstacle;
  };
  static constexpr int64_t kNever = INT64_MIN;

  void forget(double travelled_m);
  double weightOf(const CameraObstacles& seen, const RigidTransform& fixed_from_vehicle);
  void addGround(const CameraObstacles& seen, const PolarGrid& grid, const RigidTransform& fixed_from_vehicle,
                 double weight);
  GroundShadows shadowsFor(const CameraObstacles& seen, const Eigen::Vector2d& camera_m) const;
  std::vector<GroundLook> lookAtGround(const CameraObstacles& seen, const CellLooker& looker,
                                       const PolarGrid& grid, const RigidTransform& fixed_from_vehicle) const;
  void holdChanged(const std::vector<GroundLook>& looks, Timestamp stamp);
  void hold(int64_t x, int64_t y, double radius_m, Timestamp stamp);
  void addGroundLook(const GroundLook& ground, double weight, Timestamp stamp);
  void addOccupied(const CameraObstacles& seen, const PolarGrid& grid,
                   const RigidTransform& fixed_from_vehicle, double weight);
  void addLook(const Look& look, Timestamp stamp);
  double parallaxSigma_m(double range_m, const Eigen::Vector2d& direction) const;
  int8_t stateOf(const Cell& cell) const;

  LocalObstacleMapOptions options_;
  ScrollingGrid<Cell> cells_;  // of the fixed frame
  bool placed_ = false;
  Timestamp stamp_;
  RigidTransform fixed_from_vehicle_;
  double travel_m_ = 0.0;
  Eigen::Vector2d travel_direction_{0.0, 0.0};                   // unit; zero before the first motion
  std::map<std::string, Eigen::Vector2d> last_camera_position_;  // at its last look
};

}  // namespace vcharge
