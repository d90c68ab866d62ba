#pragma once

#include <functional>

#include "lighting/light_baker.h"

namespace vcharge {

/// A surface of straight lines from a high to a low edge. Going along the edges, it is seen from the side
/// that has the low edge on the right. The texture's upper border lies on the high edge, its scale is that of
/// the longest line.
struct RuledSurface {
  /// Edges at a cell border, from 0 to `cells`.
  std::function<Eigen::Vector3d(int border)> low, high;
  int cells;
  double length_m;
  double width_m;  ///< of the longest line
  int rows;        ///< of vertices that hold the ambient light, at least 2
};

/// Adds the surface with smooth normals, and returns where its light is to be baked: 2 cm inside its borders,
/// where other surfaces begin.
LitSurface addRuledSurface(const RuledSurface& surface, uint32_t material, TriangleMesh* mesh);

}  // namespace vcharge
