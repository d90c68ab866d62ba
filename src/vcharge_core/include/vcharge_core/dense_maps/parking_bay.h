#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/files/content_hash.h"

namespace vcharge {

/// Corners of an area on the ground.
using Quadrangle = std::array<Eigen::Vector2d, 4>;

/// How bays lie at their lane.
enum class BayKind : uint8_t { kPerpendicular, kAngled, kParallel };

/// Whether something stands in a bay. Unknown: too little of the bay was observed.
enum class BayState : uint8_t { kFree, kOccupied, kUnknown };
/// "free", "occupied", "unknown".
std::string nameOf(BayState state);

/// A marked parking bay, between the middles of its lines.
struct ParkingBay {
  uint32_t id = 0;
  uint32_t row = 0;  ///< bays side by side with lines between them are of one row
  BayKind kind = BayKind::kPerpendicular;
  BayState state = BayState::kUnknown;
  /// Metres in the map frame, counter-clockwise seen from above. The first two are the ends of the entry.
  Quadrangle corners_m;
  double entry_sigma_m = 0.0;  ///< standard deviation per axis of the first two corners
  double end_sigma_m = 0.0;    ///< standard deviation per axis of the last two corners
  double confidence = 0.0;     ///< from 0 to 1

  Eigen::Vector2d centre_m() const {
    return 0.25 * (corners_m[0] + corners_m[1] + corners_m[2] + corners_m[3]);
  }
  /// Corners of a part of the bay, from fractions of its width and of its length from the entry on.
  Quadrangle part(double from_side, double to_side, double from_entry, double to_entry) const;
  /// The part in which whatever stands blocks the bay: not what reaches over the lines from beside it, wheel
  /// stops and walls at its end.
  Quadrangle inside() const { return part(0.15, 0.85, 0.0, 0.9); }
  /// The part that every parked car covers, whichever way it stands.
  Quadrangle middle() const { return part(0.15, 0.85, 0.3, 0.6); }
};

/// The bays of a car park.
struct ParkingBays {
  std::string frame_id = "map";
  std::vector<ParkingBay> bays;
};

/// The cells of a grid whose middles lie in an area.
struct AreaCells {
  cv::Rect box;    ///< around the area, inside the grid; empty if they have nothing in common
  cv::Mat inside;  ///< CV_8UC1 of the box, 1 inside the area
};
/// `corners_cells`: x is the column and y the row, whole numbers at the middles of cells. None if a corner
/// lies a million cells away.
AreaCells cellsOf(const Quadrangle& corners_cells, cv::Size grid);

/// Adds frame and all bays.
void addToHash(const ParkingBays& bays, ContentHasher* hasher);

}  // namespace vcharge
