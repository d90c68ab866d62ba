#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "scenes/scene_things.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// A straight road along y = 0 with two lanes. Its first 320 m are level, with kerbs, pavements, parked cars
/// and houses; then come a lowered kerb, two speed bumps and a slope of 5 %.
inline constexpr GroundRectangle kRoadArea{-170.0, -15.0, 250.0, 15.0};
inline constexpr double kRoadLevelEnd_m = 150.0;
inline constexpr double kRoadHalfWidth_m = 3.4;
inline constexpr double kParkingDepth_m = 2.1;  ///< strip for parked cars south of the road
inline constexpr double kPavementWidth_m = 3.0;
inline constexpr double kLoweredKerb_m = 0.03;
inline constexpr double kBumpHeight_m = 0.06;
inline constexpr double kBumpLength_m = 1.2;
inline constexpr double kRoadSlope = 0.05;

struct RoadLayout {
  std::vector<GroundRectangle> pavements;
  std::vector<ParkedCar> cars;
  std::vector<Building> houses;
  std::vector<Tree> trees;
  std::vector<Pole> poles;
  std::vector<Hedge> hedges;
};
RoadLayout makeRoadLayout(uint64_t seed, const Day& day);

/// Height of the road, which depends only on x.
double roadHeight(double x_m);
/// Positions of the vertices of the road's surface along x.
std::vector<double> roadStations();

/// Reflectance of the ground divided by kGroundLayerAlbedo (CV_8UC1, row 0 at min_y): asphalt, slabs, grass
/// and markings.
cv::Mat drawRoadGround(double texel_m, uint64_t seed);

}  // namespace vcharge
