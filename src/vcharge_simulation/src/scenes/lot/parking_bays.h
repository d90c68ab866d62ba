#pragma once

#include <cstdint>
#include <vector>

#include "scenes/scene_things.h"

namespace vcharge {

inline constexpr double kBayWidth_m = 2.6;

/// A place to park.
struct ParkingBay {
  double x, y, yaw_rad;  ///< centre; cars point along yaw or against it
  int number;
  bool keep_free = false;
};

/// Cars on the bays, on ground at z = 0. Each bay has its own generator, so that another day (other than 0)
/// draws only a share `moved_cars` of the bays anew and leaves all others as they are on day 0.
std::vector<ParkedCar> parkCars(const std::vector<ParkingBay>& bays, double occupied_share, uint64_t seed,
                                int day, double moved_cars);

}  // namespace vcharge
