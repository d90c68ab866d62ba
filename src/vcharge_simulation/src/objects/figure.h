#pragma once

#include <cstdint>

#include "vcharge_simulation/rendering/mesh.h"

namespace vcharge {

struct FigureMaterials {
  uint32_t skin, jacket, trousers, shoes;
};

inline constexpr double kFigureHeight_m = 1.76;
inline constexpr double kFigureRadius_m = 0.35;
/// Distance covered by two steps.
inline constexpr double kFigureStride_m = 1.4;

/// A person at the origin who faces along x. `swing` is 0 when standing and 1 when walking; `phase_rad` is
/// the phase of the gait, with period 2 pi.
TriangleMesh makeFigure(const FigureMaterials& materials, double swing, double phase_rad);

}  // namespace vcharge
