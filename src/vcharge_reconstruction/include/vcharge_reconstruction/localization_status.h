#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// How a vehicle's pose in a map came to be, or why there is none.
enum class LocalizationStatus {
  kLocalized,          ///< the images fix it
  kTooFewMatches,      ///< too little of the map was found in the images
  kNoConsensus,        ///< no pose explains enough of what was found
  kAmbiguous,          ///< two places explain it about equally well
  kBridgedByOdometry,  ///< a fix a while ago, and the odometer since
  kLost,               ///< nothing is known, or the last fix is too long ago
};

template <>
inline std::vector<std::string> enumNames<LocalizationStatus>() {
  return {"localized", "too_few_matches", "no_consensus", "ambiguous", "bridged_by_odometry", "lost"};
}

}  // namespace vcharge
