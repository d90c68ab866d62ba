#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "scenes/lot/parking_bays.h"
#include "scenes/scene_things.h"

namespace vcharge {

/// Positions of everything on the lot. Lanes run along y = -15, 0 and 15 and along x = -26 and 26.
struct LotLayout {
  using Bay = ParkingBay;

  std::vector<GroundRectangle> islands;  ///< raised by kKerbHeight_m
  std::vector<Bay> bays;
  std::vector<ParkedCar> cars;
  std::vector<Tree> trees;
  std::vector<Bush> bushes;
  std::vector<Hedge> hedges;
  std::vector<Building> buildings;
  std::vector<Pole> poles;
  std::vector<Bin> bins;
  std::vector<Fence> fences;

  double groundHeight(double x, double y) const;
};

inline constexpr double kBayLength_m = 4.3;
/// This bay, north of the southern lane, is kept free for manoeuvres.
inline constexpr double kFreeBayX_m = -9.1;
inline constexpr double kFreeBayY_m = -9.95;

LotLayout makeLotLayout(uint64_t seed, const Day& day);

}  // namespace vcharge
