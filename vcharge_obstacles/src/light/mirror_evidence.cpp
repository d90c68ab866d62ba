#include "light/mirror_evidence.h"

#include <algorithm>

namespace vcharge {
namespace {

// Part of the counts that is kept from image to image, and their bound: what the vehicle saw before it
// stopped holds while it stands.
constexpr double kKept = 0.9, kLeastSeen = 100.0;

}  // namespace

void MirrorEvidence::endImage() {
  const double kept = seen_ > 0.0 ? std::max(kKept, std::min(1.0, kLeastSeen / seen_)) : 1.0;
  seen_ *= kept;
  reflections_ *= kept;
}

bool MirrorEvidence::isMirror() const {
  return seen_ >= kLeastSeen && reflections_ > least_part_ * seen_;
}

}  // namespace vcharge
