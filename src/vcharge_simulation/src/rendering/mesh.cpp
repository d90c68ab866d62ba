#include "vcharge_simulation/rendering/mesh.h"

#include <cmath>

namespace vcharge {

namespace {

constexpr float kTwoPi = 6.28318531F;

MeshVertex makeVertex(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, float u, float v) {
  MeshVertex vertex;
  vertex.position = position;
  vertex.normal = normal;
  vertex.u = u;
  vertex.v = v;
  return vertex;
}

void addDisk(const Eigen::Vector3f& centre, const Eigen::Vector3f& normal, const Eigen::Vector3f& side,
             float radius_m, int sides, uint32_t material, TriangleMesh* mesh) {
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  const Eigen::Vector3f other_side = normal.cross(side);
  mesh->vertices.push_back(makeVertex(centre, normal, 0.5F, 0.5F));
  for (int i = 0; i < sides; ++i) {
    const float angle = kTwoPi * static_cast<float>(i) / static_cast<float>(sides);
    const float c = std::cos(angle);
    const float s = std::sin(angle);
    mesh->vertices.push_back(makeVertex(centre + radius_m * (c * side + s * other_side), normal,
                                        0.5F + 0.5F * c, 0.5F - 0.5F * s));
  }
  for (int i = 0; i < sides; ++i) {
    const auto next = static_cast<uint32_t>((i + 1) % sides);
    mesh->triangles.push_back({{first, first + 1 + static_cast<uint32_t>(i), first + 1 + next}, material});
  }
}

}  // namespace

void TriangleMesh::append(const TriangleMesh& other, const Eigen::Isometry3f& target_from_other) {
  const auto first = static_cast<uint32_t>(vertices.size());
  const Eigen::Matrix3f rotation = target_from_other.linear();
  for (const MeshVertex& vertex : other.vertices) {
    vertices.push_back(vertex);
    vertices.back().position = target_from_other * vertex.position;
    vertices.back().normal = rotation * vertex.normal;
  }
  for (const MeshTriangle& triangle : other.triangles) {
    triangles.push_back(triangle);
    for (uint32_t& index : triangles.back().vertices) {
      index += first;
    }
  }
}

void addQuad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
             const Eigen::Vector3f& d, uint32_t material, TriangleMesh* mesh, const TextureWindow& window) {
  const Eigen::Vector3f normal = (c - a).cross(d - b).normalized();
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  mesh->vertices.push_back(makeVertex(a, normal, window.u0, window.v1));
  mesh->vertices.push_back(makeVertex(b, normal, window.u1, window.v1));
  mesh->vertices.push_back(makeVertex(c, normal, window.u1, window.v0));
  mesh->vertices.push_back(makeVertex(d, normal, window.u0, window.v0));
  mesh->triangles.push_back({{first, first + 1, first + 2}, material});
  mesh->triangles.push_back({{first, first + 2, first + 3}, material});
}

void addBox(const Eigen::Isometry3f& target_from_box, const Eigen::Vector3f& size_m, uint32_t material,
            TriangleMesh* mesh) {
  const Eigen::Vector3f half = 0.5F * size_m;
  const auto corner = [&](int x, int y, int z) -> Eigen::Vector3f {
    return target_from_box * Eigen::Vector3f(half.x() * static_cast<float>(x),
                                             half.y() * static_cast<float>(y),
                                             half.z() * static_cast<float>(z));
  };
  addQuad(corner(-1, -1, -1), corner(1, -1, -1), corner(1, -1, 1), corner(-1, -1, 1), material, mesh);
  addQuad(corner(1, -1, -1), corner(1, 1, -1), corner(1, 1, 1), corner(1, -1, 1), material, mesh);
  addQuad(corner(1, 1, -1), corner(-1, 1, -1), corner(-1, 1, 1), corner(1, 1, 1), material, mesh);
  addQuad(corner(-1, 1, -1), corner(-1, -1, -1), corner(-1, -1, 1), corner(-1, 1, 1), material, mesh);
  addQuad(corner(-1, -1, 1), corner(1, -1, 1), corner(1, 1, 1), corner(-1, 1, 1), material, mesh);
}

void addFrustum(const Eigen::Vector3f& base, const Eigen::Vector3f& top, float base_radius_m,
                float top_radius_m, int sides, bool closed, uint32_t material, TriangleMesh* mesh) {
  const Eigen::Vector3f axis = (top - base).normalized();
  const Eigen::Vector3f side = axis.unitOrthogonal();
  const Eigen::Vector3f other_side = axis.cross(side);
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  for (int i = 0; i <= sides; ++i) {
    const float fraction = static_cast<float>(i) / static_cast<float>(sides);
    const Eigen::Vector3f outwards =
        std::cos(kTwoPi * fraction) * side + std::sin(kTwoPi * fraction) * other_side;
    mesh->vertices.push_back(makeVertex(base + base_radius_m * outwards, outwards, fraction, 1.0F));
    mesh->vertices.push_back(makeVertex(top + top_radius_m * outwards, outwards, fraction, 0.0F));
  }
  for (int i = 0; i < sides; ++i) {
    const uint32_t corner = first + 2U * static_cast<uint32_t>(i);
    mesh->triangles.push_back({{corner, corner + 2, corner + 3}, material});
    mesh->triangles.push_back({{corner, corner + 3, corner + 1}, material});
  }
  if (closed) {
    addDisk(base, -axis, side, base_radius_m, sides, material, mesh);
    addDisk(top, axis, side, top_radius_m, sides, material, mesh);
  }
}

Eigen::Isometry3f placement(double x_m, double y_m, double z_m, double yaw_rad) {
  Eigen::Isometry3f result = Eigen::Isometry3f::Identity();
  result.translate(Eigen::Vector3d(x_m, y_m, z_m).cast<float>());
  result.rotate(Eigen::AngleAxisf(static_cast<float>(yaw_rad), Eigen::Vector3f::UnitZ()));
  return result;
}

}  // namespace vcharge
