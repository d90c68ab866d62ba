#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "scenes/lot/lot_plan.h"
#include "scenes/lot/parking_bays.h"
#include "scenes/scene_things.h"

namespace vcharge {

enum class Paving { kAsphalt, kCobbles, kBricks, kSlabs, kGrass };

/// Paving between these borders.
struct PavedArea {
  float min_x, min_y, max_x, max_y;
  Paving paving;
};

/// Positions of everything on the lot.
struct LotLayout {
  using Bay = PlannedBay;

  Lanes lanes;
  std::vector<PavedArea> paving;  ///< the first area counts; asphalt elsewhere
  Kerb kerb;
  std::vector<GroundRectangle> islands;  ///< raised by the kerb's height
  std::vector<GardenWall> garden_walls;
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

/// This bay, north of the southern lane, is kept free for manoeuvres.
inline constexpr double kFreeBayX_m = -9.1;
inline constexpr double kFreeBayY_m = -9.95;

LotLayout makeLotLayout(uint64_t seed, const Day& day, uint64_t layout_seed = 0);

}  // namespace vcharge
