#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/motion/tracked_object.h"
#include "vcharge_core/motion/vehicle_footprint.h"

namespace vcharge {

/// Options of CorridorFinder.
struct CorridorOptions {
  VCHARGE_BEGIN_OPTIONS(CorridorOptions);
  VCHARGE_OPTION(double, side_margin_m, 0.2, between(0.0, 5.0), "Margin on both sides of the vehicle.");
  VCHARGE_OPTION(double, horizon_m, 5.0, above(0.0).upTo(50.0),
                 "Travel within which an object that moves into the corridor is reported.");
  VCHARGE_END_OPTIONS();
};

/// An object that moves into a corridor.
struct CrossingObject {
  uint32_t id = 0;        ///< TrackedObject::id
  double time_s = 0.0;    ///< until its footprint touches the corridor; 0 if it does so already
  double travel_m = 0.0;  ///< travel at which the vehicle's outline reaches it, rounded down to 0.1 m
};

/// Objects are believed for this time after they were seen.
inline constexpr double kObjectLife_s = 1.0;
/// Objects after a time, moved with their velocities; none after more than kObjectLife_s.
std::vector<TrackedObject> movedObjects(const std::vector<TrackedObject>& objects, double time_s);
/// Objects in another frame whose z axis points up too.
std::vector<TrackedObject> transformed(const RigidTransform& target_from_source,
                                       const std::vector<TrackedObject>& objects);

/// What lies ahead in one direction of travel. Travel is the arc length of the vehicle frame's origin; on a
/// straight path it is the distance from the bumper.
struct CorridorDirection {
  /// Travel up to which every swept cell is known to be free. Unknown cells, and those outside the map, end
  /// it. After a full turn without an obstacle: the circumference.
  double known_free_m = 0.0;
  /// The same if unknown cells within kBlindRim_m of the present outline do not count: no camera sees the
  /// ground there, so that known_free_m is mostly 0. Whoever uses it must know that nothing has come to the
  /// body since the ground around it was seen.
  double free_beyond_rim_m = 0.0;
  /// Travel until the outline touches an occupied cell; infinity if it sweeps none in the map.
  double occupied_m = std::numeric_limits<double>::infinity();
  /// Fraction of the cells swept within kUnknownTravel_m that are unknown, 0 to 1.
  double unknown_fraction = 1.0;
  /// Age of the oldest observation that free_beyond_rim_m rests on; NaN if it rests on none.
  double oldest_age_s = std::numeric_limits<double>::quiet_NaN();
  std::optional<CrossingObject> crossing;  ///< the object that touches first, within kCrossingTime_s
};

/// Travel over which CorridorDirection::unknown_fraction is counted.
inline constexpr double kUnknownTravel_m = 4.0;
/// Distance from the outline with its margins up to which the ground is not seen: 0.55 m ahead of the bumper.
inline constexpr double kBlindRim_m = 0.6;
/// Time within which a crossing object is reported.
inline constexpr double kCrossingTime_s = 5.0;

/// The area that the vehicle sweeps if it keeps its curvature, forward and backward.
struct Corridor {
  double curvature_per_m = 0.0;  ///< positive: the centre of the turn is to the left
  VehicleOutline outline;        ///< with the side margins
  CorridorDirection forward, backward;

  /// Left and right end of the leading bumper, side margins included, after a travel; in the vehicle frame at
  /// the corridor's stamp.
  std::array<Eigen::Vector2d, 2> bumperAt(bool is_forward, double travel_m) const;
};

/// Finds how far the vehicle can drive along its present arc. The outline's motion is exact: each cell is met
/// where the turning rectangle first touches the square. Cells beside the vehicle that lie within the side
/// margin from the beginning count when the body itself touches them, and cells partly under the body when
/// it touches their nearest free corner; otherwise a wall beside a straight path would stop the vehicle.
///
/// The time is bounded by the number of cells and objects. Immutable; may be used by any number of threads.
class CorridorFinder {
 public:
  /// std::invalid_argument for bad options or an outline without area.
  CorridorFinder(const VehicleOutline& vehicle, const CorridorOptions& options);

  /// Objects are in the map's fixed frame, at its stamp. An object without a footprint, or with numbers that
  /// are not finite, is ignored. std::invalid_argument for a curvature that is not finite.
  Corridor find(const ObstacleMap& map, double curvature_per_m,
                const std::vector<TrackedObject>& objects) const;

  /// The object that first moves into the corridor of one direction. One that first touches the trailing
  /// bumper follows the vehicle and does not count.
  std::optional<CrossingObject> findCrossing(const RigidTransform& fixed_from_vehicle, double curvature_per_m,
                                             bool is_forward,
                                             const std::vector<TrackedObject>& objects) const;

 private:
  CorridorDirection findDirection(const ObstacleMap& map, double curvature_per_m, bool is_forward) const;

  VehicleOutline vehicle_, with_margin_;
  CorridorOptions options_;
};

}  // namespace vcharge
