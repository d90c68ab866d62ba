#pragma once

#include "objects/figure.h"

namespace vcharge {

struct BicycleMaterials {
  uint32_t frame, tyre, saddle;
};

/// A bicycle with its rider; the origin is on the ground under the middle, x forwards. `crank_rad` is the
/// angle of the pedals.
TriangleMesh makeBicycle(const BicycleMaterials& bicycle, const FigureMaterials& rider, double crank_rad);

}  // namespace vcharge
