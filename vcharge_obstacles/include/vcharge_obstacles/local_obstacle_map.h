#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_obstacles/obstacle_detector.h"
#include "vcharge_obstacles/scrolling_grid.h"

namespace vcharge {

class CellObserver;
class GroundShadows;

/// Bounds of a cell's log-odds; they ensure that a cell can change its state.
constexpr double kMinCellLogOdds = -2.5;
constexpr double kMaxCellLogOdds = 3.5;

/// Options of LocalObstacleMap.
struct LocalObstacleMapOptions {
  VCHARGE_BEGIN_OPTIONS(LocalObstacleMapOptions);
  VCHARGE_OPTION(double, cell_size_m, 0.1, between(0.01, 1.0), "Side of a cell.");
  VCHARGE_OPTION(double, half_size_m, 10.0, positive(), "Distance from the vehicle to each side of the map.");
  VCHARGE_OPTION(double, free_range_m, 7.0, positive(),
                 "Distance from a camera up to which ground is cleared.");
  VCHARGE_OPTION(double, occupied_range_m, 9.0, positive(), "Distance from a camera of obstacles used.");
  VCHARGE_OPTION(double, occupied_threshold, 1.5, above(0.0).below(kMaxCellLogOdds),
                 "Least log-odds of an occupied cell.");
  VCHARGE_OPTION(double, free_threshold, -1.0, above(kMinCellLogOdds).below(0.0),
                 "Largest log-odds of a free cell.");
  VCHARGE_OPTION(double, changed_margin_m, 0.4, notNegative(),
                 "Margin around changed ground in which no cell is free, as a body is wider than its feet.");
  VCHARGE_OPTION(double, shadow_s, 0.13, notNegative(),
                 "Time after an observation for which an obstacle hides the ground behind it.");
  VCHARGE_OPTION(double, decay_occupied_m, 15.0, positive(),
                 "Travel in which occupied log-odds fall to 1/e.");
  VCHARGE_OPTION(double, decay_free_m, 4.0, positive(), "Travel in which free log-odds fall to 1/e.");
  VCHARGE_OPTION(double, odometry_sigma_m_per_m, 0.01, notNegative(), "Drift of the odometry per travel.");
  VCHARGE_END_OPTIONS();

  void checkFields() const {
    requireField(half_size_m >= 5.0 * cell_size_m && half_size_m <= 2000.0 * cell_size_m, "half_size_m",
                 "must be 5 to 2000 cells", half_size_m);
  }
};

/// Obstacles and free ground around the vehicle, fused over time and cameras as log-odds in a grid that
/// scrolls with the vehicle in a fixed frame. A cell that is not observed again decays to unobserved with the
/// distance driven, never with time: while the vehicle stands, motion stereo measures nothing, so all cells
/// keep their state and only grow older, except where cameras that overlap measure.
///
/// Deterministic; not thread safe.
class LocalObstacleMap {
 public:
  /// Error of a camera's motion across the ray to an obstacle, relative to the motion along the ray. It makes
  /// ranges near the direction of travel uncertain, where stereo has little parallax.
  static constexpr double kParallaxSigma = 0.005;

  explicit LocalObstacleMap(const LocalObstacleMapOptions& options = LocalObstacleMapOptions());

  /// Tells an area of the ground by points in the vehicle frame.
  using GroundArea = std::function<bool(const Eigen::Vector2d& point_in_vehicle_m)>;

  /// Sets the vehicle's pose (x, y and yaw are used): scrolls, and decays by the distance driven. Free ground
  /// that is now in the area `is_hidden`, where no camera sees it, keeps its state and only grows older.
  void moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle,
              const GroundArea& is_hidden = nullptr);
  /// Adds the observation of a camera; std::logic_error before the first moveTo(). `grid` is the
  /// detector's.
  ///
  /// A range map counts by the distance that its camera has moved since its last one. One measured at rest
  /// comes from cameras that overlap, and its errors repeat: it may occupy cells, and make free ones
  /// unobserved until they are measured in motion, but neither frees a cell nor clears one that was occupied
  /// in motion. Cells occupied at rest are cleared by maps that show bare ground, at rest or not.
  void add(const CameraObstacles& seen, const PolarGrid& grid, const RigidTransform& fixed_from_vehicle,
           bool is_at_rest = false);
  /// Makes free cells unobserved for which `is_unwatched` is true. It gets their middles in the vehicle frame
  /// of the last moveTo(). Occupied cells keep their state.
  void forgetFree(const GroundArea& is_unwatched);
  /// Makes free cells within changed_margin_m of a point in the fixed frame unobserved, as the ground there
  /// has changed between two stamps; none of them becomes free within 0.3 s of the last one. Occupied cells
  /// keep their state.
  void forgetAround(const Eigen::Vector2d& point_m, Timestamp first, Timestamp last);
  /// Frees cells again that have lost their freedom after `since` and while the vehicle stood, for which
  /// `is_same` is true: their ground looks as it did then. Occupied cells keep their state.
  void restoreFree(Timestamp since, Timestamp stamp, const GroundArea& is_same);
  /// Moves all cells into a corrected fixed frame.
  void reanchor(const RigidTransform& new_from_old_fixed);

  /// The map at the last moveTo(); frame_id is left empty.
  ObstacleMap snapshot() const;

 private:
  struct Cell {
    float log_odds = 0.0F;
    float rest_log_odds = 0.0F;  // of maps measured at rest: positive if occupied; never frees the cell
    float weight = 0.0F;         // weight of the observations in the means below
    float x_m = 0.0F;            // mean position of the obstacle relative to the cell's corner
    float y_m = 0.0F;
    float sigma_m = 0.0F;
    float height_m = 0.0F;
    float height_sigma_m = 0.0F;
    float travel_m = 0.0F;          // driven distance at the last observation
    int64_t last_seen_ns = kNever;  // INT64_MIN: never
    int64_t last_occupied_ns = kNever;
    int64_t held_until_ns = kNever;  // the cell cannot become free before
    float lost_log_odds = 0.0F;      // of a free cell that became unobserved at rest, and when
    int64_t lost_ns = kNever;
  };
  /// A camera's observation of the ground in one cell.
  struct GroundObservation;
  /// What a camera's range map counts.
  struct MapWeight {
    double value;
    bool is_at_rest;
  };
  /// Part of an obstacle, in the fixed frame.
  struct ObstaclePoint {
    Eigen::Vector2d point_m;
    double mass;
    double sigma_m;  // standard deviation along the ray
    bool is_at_rest;
    const PolarObstacle* obstacle;
  };
  static constexpr int64_t kNever = INT64_MIN;

  void decay(double travelled_m, const RigidTransform& fixed_from_vehicle, const GroundArea& is_hidden);
  /// Weight of a camera's range map: maps from nearby positions use the same images, so errors correlate.
  double weightOf(const CameraObstacles& seen, const Eigen::Vector2d& position_m);
  double weightAtRest(const CameraObstacles& seen);
  /// Makes a free cell unobserved.
  static void takeFreedom(Timestamp stamp, Cell* cell);
  static void raiseAtRest(float log_odds, float most, Timestamp stamp, Cell* cell);
  static void hideAtRest(double weight, Timestamp stamp, Cell* cell);
  /// True if the cell's means shall take the observation.
  bool occupyAtRest(double mass, Timestamp stamp, Cell* cell) const;
  static void clearAtRest(double mass, Cell* cell);
  void addGround(const CameraObstacles& seen, const PolarGrid& grid, const RigidTransform& fixed_from_vehicle,
                 const MapWeight& weight);
  GroundShadows shadowsFor(const CameraObstacles& seen, const Eigen::Vector2d& camera_m) const;
  std::vector<GroundObservation> observeGround(const CameraObstacles& seen, const CellObserver& observer,
                                               const PolarGrid& grid,
                                               const RigidTransform& fixed_from_vehicle) const;
  void holdChanged(const std::vector<GroundObservation>& observations, Timestamp stamp);
  void hold(int64_t x, int64_t y, double radius_m, Timestamp first, Timestamp last);
  void addGroundObservation(const GroundObservation& ground, const MapWeight& weight, Timestamp stamp);
  void addOccupied(const CameraObstacles& seen, const PolarGrid& grid,
                   const RigidTransform& fixed_from_vehicle, const MapWeight& weight);
  void addObstaclePoint(const ObstaclePoint& point, Timestamp stamp);
  double parallaxSigma_m(double range_m, const Eigen::Vector2d& direction) const;
  static float occupiedLogOdds(const Cell& cell) { return std::max(cell.log_odds, cell.rest_log_odds); }
  int8_t stateOf(const Cell& cell) const;

  LocalObstacleMapOptions options_;
  ScrollingGrid<Cell> cells_;  // in the fixed frame
  bool has_pose_ = false;
  Timestamp stamp_;
  RigidTransform fixed_from_vehicle_;
  double travel_m_ = 0.0;
  Eigen::Vector2d travel_direction_{0.0, 0.0};                   // unit; zero before the first motion
  std::map<std::string, Eigen::Vector2d> last_camera_position_;  // at its last map in motion
  std::map<std::string, Timestamp> last_at_rest_;                // stamp of a camera's last map at rest
};

}  // namespace vcharge
