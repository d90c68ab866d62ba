#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/files/content_hash.h"

namespace vcharge {

/// How bays lie at their lane.
enum class BayKind : uint8_t { kPerpendicular, kAngled, kParallel };

/// Whether something stands in a bay. Unknown: too little of the bay was observed.
enum class BayState : uint8_t { kFree, kOccupied, kUnknown };

/// A marked parking bay, between the middles of its lines.
struct ParkingBay {
  uint32_t id = 0;
  uint32_t row = 0;  ///< bays side by side with lines between them are of one row
  BayKind kind = BayKind::kPerpendicular;
  BayState state = BayState::kUnknown;
  /// Metres in the map frame, counter-clockwise seen from above. The first two are the ends of the entry.
  std::array<Eigen::Vector2d, 4> corners_m;
  double entry_sigma_m = 0.0;  ///< standard deviation per axis of the first two corners
  double end_sigma_m = 0.0;    ///< standard deviation per axis of the last two corners
  double confidence = 0.0;     ///< from 0 to 1

  Eigen::Vector2d centre_m() const {
    return 0.25 * (corners_m[0] + corners_m[1] + corners_m[2] + corners_m[3]);
  }
};

/// The bays of a car park.
struct ParkingBays {
  std::string frame_id = "map";
  std::vector<ParkingBay> bays;
};

/// Adds frame and all bays.
void addToHash(const ParkingBays& bays, ContentHasher* hasher);

}  // namespace vcharge
