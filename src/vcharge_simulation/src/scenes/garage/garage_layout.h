#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lighting/lamp_light.h"
#include "scenes/lane_paths.h"
#include "scenes/lot/parking_bays.h"
#include "scenes/scene_things.h"

namespace vcharge {

/// Inner faces of the garage. Lanes run along y = -15.5, 0 and 15.5 and along x = -26 and 26.
inline constexpr GroundRectangle kGarageArea{-32.0, -23.5, 32.0, 23.5};
inline constexpr Lanes kGarageLanes{26.0, 15.5, 5.0};
inline constexpr double kGarageHeight_m = 2.75;
inline constexpr double kBeamHeight_m = 2.42;  ///< lower edge of the beams
/// This bay, north of the southern lane, is kept free for manoeuvres.
inline constexpr double kFreeGarageBayX_m = -10.4;
inline constexpr double kGarageBayLength_m = 4.8;

/// Positions of everything in the garage.
struct GarageLayout {
  struct Pillar {
    double x, y;
    std::string name;
  };

  std::vector<ParkingBay> bays;
  std::vector<ParkedCar> cars;
  std::vector<Pillar> pillars;
  std::vector<double> beam_x;  ///< beams across the garage
  std::vector<double> beam_y;  ///< beams along the garage
  std::vector<Lamp> lamps;
};

inline constexpr double kPillarWidth_m = 0.5;

GarageLayout makeGarageLayout(uint64_t seed, const Day& day);

}  // namespace vcharge
