#pragma once

#include <optional>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/parking_bay.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A bay and what stands in it now. ParkingBay::state is unknown until the bay has been observed.
struct MonitoredBay {
  ParkingBay bay;
  std::optional<Timestamp> since;     ///< the bay has been observed in its state since
  std::optional<Timestamp> observed;  ///< last time that enough of the bay was seen to tell its state
};

/// Tells for the bays of a car park whether they are free or occupied, from the obstacles around a vehicle
/// that knows its pose in the map of the bays.
///
/// A bay is occupied if obstacles stand inside of it, and free if half of its middle, which every parked car
/// covers, is known to be free and nothing stands inside. Otherwise the map says nothing about it, and the
/// bay keeps its state and the time at which it was observed last. A state changes when maps over half a
/// second agree on another one.
class BayMonitor {
 public:
  /// Positions that are less certain than this do not tell in which bay an obstacle stands.
  static constexpr double kMaxPositionSigma_m = 0.3;

  explicit BayMonitor(const ParkingBays& bays);

  /// Maps come in order of their stamps; one that is older than the last begins a new drive, in which no bay
  /// has been observed. `map_from_fixed` leads from the map's fixed frame to the frame of the bays. Returns
  /// whether the state of a bay has changed.
  bool add(const ObstacleMap& map, const RigidTransform& map_from_fixed);

  const std::vector<MonitoredBay>& bays() const { return bays_; }

 private:
  /// A state that maps have told since a time, without one that told another.
  struct Claim {
    BayState state = BayState::kUnknown;
    Timestamp since;
  };

  std::vector<MonitoredBay> bays_;
  std::vector<Claim> claims_;
  std::optional<Timestamp> last_;
};

}  // namespace vcharge
