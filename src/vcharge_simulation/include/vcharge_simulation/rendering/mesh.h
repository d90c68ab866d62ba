#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace vcharge {

struct MeshVertex {
  Eigen::Vector3f position;  ///< metres
  Eigen::Vector3f normal;    ///< unit, outwards
  float u = 0.0F, v = 0.0F;  ///< in [0, 1] over the material's texture
  float ambient = 1.0F;      ///< fraction of the ambient light that reaches the vertex
};

struct MeshTriangle {
  std::array<uint32_t, 3> vertices;
  uint32_t material;  ///< index into Scene::materials
};

/// Triangles with materials. Surfaces must be closed or visible only from outside unless their material is
/// two-sided.
struct TriangleMesh {
  std::vector<MeshVertex> vertices;
  std::vector<MeshTriangle> triangles;

  /// Appends `other`, transformed by `target_from_other`.
  void append(const TriangleMesh& other, const Eigen::Isometry3f& target_from_other);
};

/// Rectangle in the unit coordinates of a texture.
struct TextureWindow {
  float u0 = 0.0F, v0 = 0.0F, u1 = 1.0F, v1 = 1.0F;
};

/// Flat quad a, b, c, d counter-clockwise seen from outside; a is at (u0, v1) of the window, c at (u1, v0).
void addQuad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
             const Eigen::Vector3f& d, uint32_t material, TriangleMesh* mesh,
             const TextureWindow& window = TextureWindow());

/// Box of `size_m` centred at `target_from_box`, without its bottom face; each face shows the whole texture.
void addBox(const Eigen::Isometry3f& target_from_box, const Eigen::Vector3f& size_m, uint32_t material,
            TriangleMesh* mesh);

/// Cone frustum from `base` to `top` with smooth normals, with flat ends if `closed`.
void addFrustum(const Eigen::Vector3f& base, const Eigen::Vector3f& top, float base_radius_m,
                float top_radius_m, int sides, bool closed, uint32_t material, TriangleMesh* mesh);

/// Transform to the position (x, y, z), rotated by yaw about z.
Eigen::Isometry3f placement(double x_m, double y_m, double z_m, double yaw_rad);

}  // namespace vcharge
