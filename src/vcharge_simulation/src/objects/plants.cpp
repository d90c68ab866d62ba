#include "objects/plants.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kLeaf_m = 0.075;
constexpr double kTwoPi = 6.28318530717958647692;
// Number of leaves in a ball of foliage times (leaf length / radius)^2, so that the leaves hide most of what
// is behind.
constexpr double kLeafAreaPerBall = 13.0;

Eigen::Vector3d randomDirection(Random* random) {
  const double z = random->uniform(-1.0, 1.0);
  const double azimuth = random->uniform(0.0, kTwoPi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(azimuth), r * std::sin(azimuth), z};
}

// Adds a leaf: one triangle that faces roughly along `outwards`. `ambient` is the light that reaches it, and
// its u coordinate selects a tone of the leaf texture, dark to bright. A triangle larger than a leaf stands
// for several leaves, so its tone and shading vary less.
void addLeaf(const Eigen::Vector3d& position, const Eigen::Vector3d& outwards, double size_m, double ambient,
             uint32_t material, Random* random, TriangleMesh* mesh) {
  const double averaging = std::max(1.0, size_m / kLeaf_m);
  const Eigen::Vector3d scatter = 0.9 * randomDirection(random);
  const Eigen::Vector3d normal = (outwards + scatter).normalized();
  const Eigen::Vector3d along = normal.cross(randomDirection(random)).normalized() * size_m;
  const Eigen::Vector3d across = normal.cross(along) * 0.42;
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  MeshVertex vertex;
  // Shading follows the crown more than the single leaf, because leaves scatter light among each other.
  const Eigen::Vector3d mean_normal = (outwards + scatter / averaging).normalized();
  vertex.normal = (0.6 * outwards + mean_normal).normalized().cast<float>();
  vertex.ambient = static_cast<float>(ambient);
  vertex.u = static_cast<float>(0.5 + random->uniform(-0.5, 0.5) / averaging);
  vertex.v = 0.5F;
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(position - 0.5 * along - across), Eigen::Vector3d(position - 0.5 * along + across),
        Eigen::Vector3d(position + 0.7 * along)}) {
    vertex.position = corner.cast<float>();
    mesh->vertices.push_back(vertex);
  }
  mesh->triangles.push_back({{first, first + 1, first + 2}, material});
}

// Adds leaves in a ball, most of them near its surface.
void addLeafBall(const Eigen::Vector3d& centre, const Eigen::Vector3d& radii, int count, double leaf_m,
                 double shade, uint32_t material, Random* random, TriangleMesh* mesh) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d direction = randomDirection(random);
    const double depth = std::cbrt(random->uniform(0.25, 1.15));
    const Eigen::Vector3d position = centre + depth * direction.cwiseProduct(radii);
    const double ambient =
        shade * std::clamp(0.25 + 0.75 * (depth - 0.55) * 2.0 + 0.2 * direction.z(), 0.1, 1.0);
    addLeaf(position, direction, leaf_m * random->uniform(0.7, 1.3), ambient, material, random, mesh);
  }
}

void addEllipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& radii, uint32_t material,
                  TriangleMesh* mesh) {
  constexpr int kAround = 10;
  constexpr int kUp = 6;
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  for (int j = 0; j <= kUp; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const double polar = 3.14159265358979 * j / kUp;
      const double azimuth = kTwoPi * i / kAround;
      const Eigen::Vector3d direction(std::sin(polar) * std::cos(azimuth),
                                      std::sin(polar) * std::sin(azimuth), std::cos(polar));
      MeshVertex vertex;
      vertex.position = (centre + direction.cwiseProduct(radii)).cast<float>();
      vertex.normal = direction.cast<float>();
      vertex.ambient = 0.2F;
      mesh->vertices.push_back(vertex);
    }
  }
  for (uint32_t j = 0; j < kUp; ++j) {
    for (uint32_t i = 0; i < kAround; ++i) {
      const uint32_t a = first + j * kAround + i;
      const uint32_t b = first + j * kAround + (i + 1) % kAround;
      mesh->triangles.push_back({{a, a + kAround, b + kAround}, material});
      mesh->triangles.push_back({{a, b + kAround, b}, material});
    }
  }
}

}  // namespace

TriangleMesh makeTree(const PlantMaterials& materials, double leaf_m, double density, uint64_t seed) {
  Random random(seed);
  TriangleMesh mesh;
  const double trunk_m = random.uniform(1.7, 2.6);
  const double crown_radius_m = random.uniform(1.6, 2.4);
  const double crown_height_m = random.uniform(1.8, 2.6);
  Eigen::Vector3d joint(0.0, 0.0, -0.05);
  double radius = random.uniform(0.13, 0.2);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d next =
        joint + Eigen::Vector3d(random.normal() * 0.08, random.normal() * 0.08, trunk_m / 3.0);
    addFrustum(joint.cast<float>(), next.cast<float>(), static_cast<float>(radius),
               static_cast<float>(radius * 0.85), 9, false, materials.bark, &mesh);
    joint = next;
    radius *= 0.85;
  }
  const Eigen::Vector3d crown = joint + Eigen::Vector3d(0.0, 0.0, 0.5 * crown_height_m);
  const int num_balls = 30 + random.index(10);
  for (int i = 0; i < num_balls; ++i) {
    const Eigen::Vector3d direction = randomDirection(&random);
    const double reach = random.uniform(0.45, 1.0);
    const Eigen::Vector3d centre = crown + reach * direction.cwiseProduct(Eigen::Vector3d(
                                                       crown_radius_m, crown_radius_m, crown_height_m));
    addFrustum(joint.cast<float>(), centre.cast<float>(), static_cast<float>(0.4 * radius), 0.01F, 5, false,
               materials.bark, &mesh);
    const double ball = random.uniform(0.5, 0.95);
    const double shade = std::clamp(0.45 + 0.35 * reach + 0.25 * direction.z(), 0.2, 1.0);
    addLeafBall(centre, {ball, ball, 0.75 * ball},
                static_cast<int>(density * kLeafAreaPerBall * ball * ball / (leaf_m * leaf_m)), leaf_m, shade,
                materials.leaves, &random, &mesh);
  }
  return mesh;
}

TriangleMesh makeBush(const PlantMaterials& materials, double radius_m, double height_m, double leaf_scale,
                      double density, uint64_t seed) {
  density /= leaf_scale * leaf_scale;
  Random random(seed);
  TriangleMesh mesh;
  const Eigen::Vector3d radii(radius_m, radius_m, 0.5 * height_m);
  addEllipsoid({0.0, 0.0, 0.45 * height_m}, 0.72 * radii, materials.dark_core, &mesh);
  const int num_balls = 6 + random.index(6);
  const double area = radius_m * height_m;
  for (int i = 0; i < num_balls; ++i) {
    const Eigen::Vector3d direction = randomDirection(&random);
    const Eigen::Vector3d centre =
        Eigen::Vector3d(0.0, 0.0, 0.5 * height_m) + 0.5 * direction.cwiseProduct(radii);
    addLeafBall(centre, 0.58 * radii, static_cast<int>(density * 380.0 * area), 0.075 * leaf_scale,
                std::clamp(0.7 + 0.3 * direction.z(), 0.3, 1.0), materials.leaves, &random, &mesh);
  }
  return mesh;
}

TriangleMesh makeHedge(const PlantMaterials& materials, const Eigen::Vector3d& size_m, double leaf_scale,
                       double density, uint64_t seed) {
  density /= leaf_scale * leaf_scale;
  Random random(seed);
  TriangleMesh mesh;
  const Eigen::Vector3d half = 0.5 * size_m;
  addBox(placement(0.0, 0.0, half.z(), 0.0), (0.82 * size_m).cast<float>(), materials.dark_core, &mesh);
  struct Face {
    Eigen::Vector3d normal, side, up;
  };
  const std::vector<Face> faces = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                   {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                   {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},
                                   {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
                                   {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}};
  for (const Face& face : faces) {
    const double area = 4.0 * std::abs(half.dot(face.side)) * std::abs(half.dot(face.up));
    const int count = static_cast<int>(density * 420.0 * area);
    for (int i = 0; i < count; ++i) {
      const double depth = random.uniform(-0.12, 0.05);
      const Eigen::Vector3d position = Eigen::Vector3d(0.0, 0.0, half.z()) +
                                       half.cwiseProduct(face.normal + random.uniform(-1.0, 1.0) * face.side +
                                                         random.uniform(-1.0, 1.0) * face.up) +
                                       depth * face.normal;
      addLeaf(position, face.normal, 0.06 * leaf_scale * random.uniform(0.7, 1.3),
              std::clamp(0.8 + 4.0 * depth, 0.25, 1.0), materials.leaves, &random, &mesh);
    }
  }
  return mesh;
}

void addGrassTuft(const Eigen::Vector3f& base, double radius_m, int count, uint32_t material, uint64_t seed,
                  TriangleMesh* mesh) {
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d foot =
        base.cast<double>() + Eigen::Vector3d(random.normal(), random.normal(), 0.0) * 0.5 * radius_m;
    const double height_m = random.uniform(0.06, 0.2);
    const Eigen::Vector3d lean(random.normal() * 0.05, random.normal() * 0.05, height_m);
    const Eigen::Vector3d across =
        Eigen::Vector3d(random.normal(), random.normal(), 0.0).normalized() * 0.006;
    const auto first = static_cast<uint32_t>(mesh->vertices.size());
    MeshVertex vertex;
    vertex.normal = Eigen::Vector3f(across.y() > 0 ? 0.5F : -0.5F, 0.0F, 0.86F);
    vertex.u = static_cast<float>(random.uniform());
    vertex.v = 0.5F;
    for (const Eigen::Vector3d& corner :
         {Eigen::Vector3d(foot - across), Eigen::Vector3d(foot + across), Eigen::Vector3d(foot + lean)}) {
      vertex.position = corner.cast<float>();
      mesh->vertices.push_back(vertex);
      vertex.ambient = 1.0F;
    }
    mesh->triangles.push_back({{first, first + 1, first + 2}, material});
  }
}

}  // namespace vcharge
