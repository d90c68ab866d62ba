#pragma once

#include <cstdint>
#include <vector>

#include "scenes/scene_things.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

inline constexpr double kBayWidth_m = 2.6;

/// A bay for one car.
struct ParkingBay {
  double x, y, yaw_rad;  ///< centre; cars point along the yaw or against it
  int number;
  bool keep_free = false;
  bool is_oblique = false;  ///< angled or parallel to the lane
};

/// The bays at right angles to their lane: movers know no way out of others.
std::vector<ParkingBay> baysToLeave(const std::vector<ParkingBay>& bays);

/// Parks cars on level ground at z = 0. Each bay has its own random generator, so that a day redraws only a
/// fraction of the bays and keeps the others. A redrawn bay is empty or holds another car in another pose. A
/// larger fraction redraws more bays besides those of a smaller one.
std::vector<ParkedCar> parkCars(const std::vector<ParkingBay>& bays, double occupied_fraction, uint64_t seed,
                                const Day& day);

}  // namespace vcharge
