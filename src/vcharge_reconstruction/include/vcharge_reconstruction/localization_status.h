#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Source of a vehicle's pose in a map, or the reason why there is none.
enum class LocalizationStatus {
  kLocalized,          ///< a pose from the images
  kTooFewMatches,      ///< too few landmarks were matched
  kNoConsensus,        ///< no pose explains enough matches
  kAmbiguous,          ///< two poses explain the matches about equally well
  kBridgedByOdometry,  ///< a recent pose from images, extrapolated by odometry
  kLost,               ///< no recent pose
};

template <>
inline std::vector<std::string> enumNames<LocalizationStatus>() {
  return {"localized", "too_few_matches", "no_consensus", "ambiguous", "bridged_by_odometry", "lost"};
}

}  // namespace vcharge
