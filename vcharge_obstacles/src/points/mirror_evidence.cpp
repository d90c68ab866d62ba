#include "points/mirror_evidence.h"

#include <algorithm>

namespace vcharge {
namespace {

// Part of the counts that is kept from image to image, and their bound: what the vehicle saw before it
// stopped holds while it stands.
constexpr double kKept = 0.9, kLeastPoints = 100.0;
// Least part of the points that are reflections. On one simulated drive it is 0.07 to 0.14 in the wet, and
// at most 0.006 at noon.
constexpr double kLeastPart = 0.03;

}  // namespace

void MirrorEvidence::endImage() {
  const double kept = points_ > 0.0 ? std::max(kKept, std::min(1.0, kLeastPoints / points_)) : 1.0;
  points_ *= kept;
  below_ground_ *= kept;
}

bool MirrorEvidence::isMirror() const {
  return points_ >= kLeastPoints && below_ground_ > kLeastPart * points_;
}

}  // namespace vcharge
