#pragma once

#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/parking_bay.h"
#include "vcharge_core/motion/vehicle_footprint.h"

namespace vcharge {

/// A gap beside the vehicle's path in which it can park, painted or not.
struct ParkingGap {
  BayKind kind = BayKind::kParallel;  ///< kParallel or kPerpendicular
  /// In the map's fixed frame, counter-clockwise from above. The first two are the ends of the entry.
  Quadrangle corners_m;
  double length_m = 0.0;        ///< free length of the entry, along the path
  double length_sigma_m = 0.0;  ///< its standard deviation
  double depth_m = 0.0;         ///< free depth at right angles to the path, rounded down to cells
};

/// Finds gaps between things that stand on both sides of the vehicle's path, such as parked cars, in the
/// obstacles around the vehicle. All ground of a gap is known to be free, except next to the things at its
/// ends.
///
/// A gap for parking parallel to the path is as long as VehicleFootprint::minParallelGap_m(), deeper than the
/// vehicle is wide, and closed at its back by something: a lane that joins the path is open. A gap at right
/// angles to the path is deeper than the vehicle is long, wide enough to open doors, and less wide than a
/// lane. The path is taken to run along the vehicle's axis.
///
/// Immutable; may be used by any number of threads.
class GapFinder {
 public:
  /// std::invalid_argument for a footprint that cannot be.
  explicit GapFinder(const VehicleFootprint& vehicle);

  /// From the back to the front, on the left before those on the right.
  std::vector<ParkingGap> find(const ObstacleMap& map) const;

 private:
  VehicleFootprint vehicle_;
};

}  // namespace vcharge
