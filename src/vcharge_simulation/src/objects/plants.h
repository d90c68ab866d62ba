#pragma once

#include <cstdint>

#include "vcharge_simulation/rendering/mesh.h"

namespace vcharge {

struct PlantMaterials {
  uint32_t bark, leaves, dark_core;
};

/// A tree about 6 m high at the origin. Each leaf is a triangle of length `leaf_m`, and there are enough to
/// fill the crown; `density` scales their number.
TriangleMesh makeTree(const PlantMaterials& materials, double leaf_m, double density, uint64_t seed);
/// A bush of the given radius and height at the origin. `leaf_scale` is the length of leaves relative to 7
/// cm.
TriangleMesh makeBush(const PlantMaterials& materials, double radius_m, double height_m, double leaf_scale,
                      double density, uint64_t seed);
/// A clipped hedge: a box of `size_m` whose base is centred at the origin.
TriangleMesh makeHedge(const PlantMaterials& materials, const Eigen::Vector3d& size_m, double leaf_scale,
                       double density, uint64_t seed);
/// Adds `count` blades of grass within `radius_m` of `base`.
void addGrassTuft(const Eigen::Vector3f& base, double radius_m, int count, uint32_t material, uint64_t seed,
                  TriangleMesh* mesh);

}  // namespace vcharge
