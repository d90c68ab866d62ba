#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lighting/lamp_light.h"
#include "scenes/garage/garage_plan.h"
#include "scenes/lot/parking_bays.h"
#include "scenes/scene_things.h"

namespace vcharge {

inline constexpr double kGarageBayLength_m = 4.8;

/// Positions of everything in the garage.
struct GarageLayout {
  struct Pillar {
    double x, y;
    std::string name;
  };

  GaragePlan plan;
  std::vector<PlannedBay> bays;
  std::vector<ParkedCar> cars;
  std::vector<Pillar> pillars;
  std::vector<double> beam_x;  ///< beams across the garage
  std::vector<double> beam_y;  ///< beams along the garage
  std::vector<Lamp> lamps;
};

GarageLayout makeGarageLayout(uint64_t seed, const Day& day, uint64_t layout_seed = 0);

}  // namespace vcharge
