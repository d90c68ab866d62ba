#pragma once

#include <cstdint>
#include <vector>

#include "scenes/lot/lot_plan.h"
#include "scenes/scene_things.h"
#include "vcharge_core/dense_maps/parking_bay.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

inline constexpr double kBayWidth_m = 2.6;

/// A bay for one car.
struct PlannedBay {
  double x, y, yaw_rad;  ///< centre; cars point along the yaw or against it
  int number;
  bool keep_free = false;
  BayKind kind = BayKind::kPerpendicular;
  bool is_north_of_lane = false;  ///< of parallel bays; others lie along their yaw from the lane
  double length_m = kBayLength_m;
};

/// Width and length between the lines of a bay that is parallel to its lane.
inline constexpr double kParallelWidth_m = 2.3, kParallelLength_m = 6.2;

/// The bays at right angles to their lane: movers know no way out of others.
std::vector<PlannedBay> baysToLeave(const std::vector<PlannedBay>& bays);

/// Parks cars on level ground at z = 0. Each bay has its own random generator, so that a day redraws only a
/// fraction of the bays and keeps the others. A redrawn bay is empty or holds another car in another pose. A
/// larger fraction redraws more bays besides those of a smaller one.
std::vector<ParkedCar> parkCars(const std::vector<PlannedBay>& bays, double occupied_fraction, uint64_t seed,
                                const Day& day);

/// The bays as they are painted: between the middles of their lines. A line between two angled bays reaches
/// from the entry of one to the end of the other.
std::vector<ParkingBay> paintedBays(const std::vector<PlannedBay>& bays, const std::vector<ParkedCar>& cars);

}  // namespace vcharge
