#include "fusion/ground_evidence.h"

#include <algorithm>
#include <utility>

namespace vcharge {
namespace {

// Fraction of a cell's pixels that have changed from which its ground has.
constexpr float kMinChangedFraction = 0.4F;

}  // namespace

void addAppearance(GroundAppearance appearance, const PolarGrid& grid, CameraObstacles* seen) {
  seen->changed_fraction = std::move(appearance.changed_fraction);
  if (appearance.ground_pixels.empty() || seen->changed_fraction.empty() || seen->expected_ground.empty()) {
    return;
  }
  for (int ray = 0; ray < grid.numRays(); ++ray) {
    const double overhung_from_m =
        seen->overhung_from_m.empty() ? grid.maxRange_m() : seen->overhung_from_m[static_cast<size_t>(ray)];
    for (int bin = grid.numBins() - 1; bin >= 0 && grid.range_m(bin) <= overhung_from_m; --bin) {
      const size_t index = grid.index(ray, bin);
      if (seen->changed_fraction[index] >= kMinChangedFraction) {
        break;
      }
      const float fraction =
          std::min(1.0F, appearance.ground_pixels[index] / (seen->expected_ground[index] + 1.0F));
      if (fraction > seen->free_fraction[index]) {
        seen->free_fraction[index] = fraction;
        seen->unknown_fraction[index] = std::min(seen->unknown_fraction[index], 1.0F - fraction);
      }
    }
  }
}

}  // namespace vcharge
