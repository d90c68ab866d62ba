#pragma once

#include <cstdint>
#include <vector>

#include "scenes/scene_things.h"

namespace vcharge {

inline constexpr double kBayWidth_m = 2.6;

/// A bay for one car.
struct ParkingBay {
  double x, y, yaw_rad;  ///< centre; cars point along the yaw or against it
  int number;
  bool keep_free = false;
  bool is_oblique = false;  ///< angled or parallel to the lane
};

/// Parks cars on level ground at z = 0. Each bay has its own random generator, so that a day other than 0
/// redraws only some of the bays and keeps the others.
std::vector<ParkedCar> parkCars(const std::vector<ParkingBay>& bays, double occupied_fraction, uint64_t seed,
                                int day);

}  // namespace vcharge
