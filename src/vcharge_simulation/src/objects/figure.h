#pragma once

#include <cstdint>

#include "vcharge_simulation/rendering/mesh.h"

namespace vcharge {

struct FigureMaterials {
  uint32_t skin, jacket, trousers, shoes;
};

/// Proportions of a figure relative to an adult's.
struct FigureShape {
  float legs = 1.0F, trunk = 1.0F, head = 1.0F, width = 1.0F;
  double height() const;
  double radius() const;
  /// Distance covered by two steps.
  double stride() const;
};

inline constexpr double kFigureHeight_m = 1.76;
inline constexpr double kFigureRadius_m = 0.35;
/// Distance covered by two steps.
inline constexpr double kFigureStride_m = 1.4;

/// A person at the origin who faces along x. `swing` is 0 when standing and 1 when walking; `phase_rad` is
/// the phase of the gait, with period 2 pi.
TriangleMesh makeFigure(const FigureMaterials& materials, double swing, double phase_rad,
                        const FigureShape& shape = FigureShape());

/// End of a limb that hangs from `from`, rotated forwards by an angle.
Eigen::Vector3f hangLimb(const Eigen::Vector3f& from, double forwards_rad, float length_m);
/// Head and neck of a figure whose pelvis is at `pelvis`.
void addFigureHead(const FigureMaterials& materials, const FigureShape& shape, const Eigen::Vector3f& pelvis,
                   TriangleMesh* mesh);

}  // namespace vcharge
