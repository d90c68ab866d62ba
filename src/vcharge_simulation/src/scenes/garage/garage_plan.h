#pragma once

#include <cstdint>

#include "scenes/lane_paths.h"
#include "scenes/scene_things.h"

namespace vcharge {

/// Inner faces and lanes of the known garage.
inline constexpr GroundRectangle kGarageArea{-32.0, -23.5, 32.0, 23.5};
inline constexpr Lanes kGarageLanes{26.0, 15.5, 5.0};

/// Look of the walls.
struct GarageWallKind {
  double tone = 0.6;          ///< reflectance
  double band_m = 1.1;        ///< height of the painted band above the floor
  double band_tone = 0.55;    ///< of the band, relative to the wall
  double fixture_gaps = 1.0;  ///< factor on the distances between signs and doors
};

/// Sizes of a garage: two double rows of bays between three lanes, rows along the southern and northern
/// walls.
struct GaragePlan {
  GroundRectangle area = kGarageArea;
  Lanes lanes = kGarageLanes;
  int bays_per_row = 17;
  int bays_per_pillar = 3;
  bool pillars_beside_rows = true;  ///< one more column of pillars than the rows are long
  double free_bay_x_m = -10.4;      ///< this bay, north of the southern lane, is kept free for manoeuvres
  double widening_m = 0.0;          ///< of the middle lane, on either side
  double wall_widening_m = 0.0;     ///< of the outer lanes, towards the wall
  double height_m = 2.75;
  double beam_height_m = 2.42;  ///< lower edge of the beams
  double pillar_width_m = 0.5;
  bool has_round_pillars = false;
  bool has_lamps_over_bays = true;
  double lamp_strength = 1.0;
  GarageWallKind walls;

  /// Draws a plan; seed 0 gives the known one.
  static GaragePlan fromSeed(uint64_t layout_seed);

  double firstBay() const { return -0.5 * bays_per_row * kGarageBayWidth_m; }
  /// Where a thing at `y` of the known garage is; the lanes' widening moves it.
  double shifted(double y) const;
  /// What hangs under the beams is this much higher than in the known garage.
  double lift() const { return beam_height_m - 2.42; }
  /// Ducts and lamps are above this height.
  double overhead() const { return 2.1 + lift(); }

  static constexpr double kGarageBayWidth_m = 2.6;
};

}  // namespace vcharge
