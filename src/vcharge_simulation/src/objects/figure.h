#pragma once

#include <cstdint>

#include "vcharge_simulation/rendering/mesh.h"

namespace vcharge {

struct FigureMaterials {
  uint32_t skin, jacket, trousers, shoes;
};

inline constexpr double kFigureHeight_m = 1.76;
inline constexpr double kFigureRadius_m = 0.35;
/// Way of two steps.
inline constexpr double kFigureStride_m = 1.4;

/// A person at the origin who faces along x. swing: 0 stands, 1 walks; phase_rad: of the gait, which repeats
/// every 2 pi.
TriangleMesh makeFigure(const FigureMaterials& materials, double swing, double phase_rad);

}  // namespace vcharge
