#include "lighting/light_baker.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr float kTwoPi = 6.28318531F;
constexpr float kSunRadius_rad = 0.0047F;
constexpr float kLift_m = 0.012F;
constexpr float kFar_m = 120.0F;
// Ambient light varies slowly, so it is sampled on a coarser grid than the sun's shadows.
constexpr int kSurroundingStride = 5;
constexpr int kSurroundingRays = 32;
constexpr int kWallRays = 8;
constexpr float kSkyReach_m = 25.0F;
// Surfaces that block the sky reflect this fraction of its light themselves.
constexpr float kOwnLight = 0.15F;

// Direction about `normal` with density proportional to the cosine.
Eigen::Vector3f cosineDirection(const Eigen::Vector3f& normal, float u, float v) {
  const Eigen::Vector3f side = normal.unitOrthogonal();
  const Eigen::Vector3f other = normal.cross(side);
  const float r = std::sqrt(u);
  return (r * std::cos(kTwoPi * v) * side + r * std::sin(kTwoPi * v) * other + std::sqrt(1.0F - u) * normal)
      .normalized();
}

float freeSky(const RayTracer& tracer, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
              int rays, uint32_t hash, float reach_m) {
  int free = 0;
  for (int i = 0; i < rays; ++i) {
    const float u = (static_cast<float>(i) + unitFromBits(mixBits(hash + 2U * static_cast<uint32_t>(i)))) /
                    static_cast<float>(rays);
    const float v = std::fmod(0.61803399F * static_cast<float>(i) + unitFromBits(hash), 1.0F);
    const Eigen::Vector3f direction = cosineDirection(normal, u, v);
    free += tracer.occluded(position + kLift_m * normal, direction, reach_m) ? 0 : 1;
  }
  return static_cast<float>(free) / static_cast<float>(rays);
}

// Samples directions to the disk of the sun.
class SunDisk {
 public:
  explicit SunDisk(const Eigen::Vector3f& centre)
      : centre_(centre), side_(centre.unitOrthogonal()), other_(centre.cross(side_)) {}

  Eigen::Vector3f direction(uint32_t hash) const {
    const float radius = kSunRadius_rad * std::sqrt(unitFromBits(hash));
    const float angle = kTwoPi * unitFromBits(mixBits(hash + 1U));
    return (centre_ + radius * std::cos(angle) * side_ + radius * std::sin(angle) * other_).normalized();
  }

 private:
  Eigen::Vector3f centre_, side_, other_;
};

}  // namespace

void bakeWallLight(const std::vector<Wall>& walls, double texel_m, Scene* scene) {
  std::vector<LitSurface> surfaces;
  for (const Wall& wall : walls) {
    const Eigen::Vector3f normal = wall.along.cross(wall.up).normalized();
    const auto point_at = [wall, normal](float u, float v) {
      return LitSurface::Point{wall.foot + u * wall.along + (1.0F - v) * wall.up, normal};
    };
    surfaces.push_back({point_at, {wall.along.norm(), wall.up.norm()}, wall.material});
  }
  bakeSunMaps(surfaces, texel_m, scene);
}

void bakeSunMaps(const std::vector<LitSurface>& surfaces, double texel_m, Scene* scene) {
  const RayTracer tracer(scene->mesh);
  const SunDisk sun(scene->sky->directionToSun());
  for (const LitSurface& surface : surfaces) {
    const int width = std::max(1, static_cast<int>(std::lround(surface.size_m.x() / texel_m)));
    const int height = std::max(1, static_cast<int>(std::lround(surface.size_m.y() / texel_m)));
    cv::Mat image(height, width, CV_8UC1);
    tbb::parallel_for(0, height, [&](int row) {
      for (int column = 0; column < width; ++column) {
        int lit = 0;
        for (int i = 0; i < kWallRays; ++i) {
          const uint32_t hash = hashCell(column * kWallRays + i, row, surface.material);
          const float u =
              (static_cast<float>(column) + unitFromBits(mixBits(hash + 2U))) / static_cast<float>(width);
          const float v =
              (static_cast<float>(row) + unitFromBits(mixBits(hash + 3U))) / static_cast<float>(height);
          const LitSurface::Point point = surface.pointAt(u, v);
          const bool is_lit =
              point.normal.dot(scene->sky->directionToSun()) > 0.0F &&
              !tracer.occluded(point.position + kLift_m * point.normal, sun.direction(hash), kFar_m);
          lit += is_lit ? 1 : 0;
        }
        image.at<uint8_t>(row, column) = static_cast<uint8_t>(255 * lit / kWallRays);
      }
    });
    Material& material = scene->materials[surface.material];
    material.sun_map = static_cast<int>(scene->textures.size());
    material.sun_map_texels_per_m = static_cast<float>(1.0 / texel_m);
    scene->textures.emplace_back(image, Texture::Border::kClamp);
  }
}

void bakeSkyLight(const std::vector<LitSurface>& surfaces, int rays_per_vertex, Scene* scene) {
  const RayTracer tracer(scene->mesh);
  const auto from_sky = static_cast<float>(scene->sky->light().sky_irradiance);
  const auto from_ground = static_cast<float>(scene->sky->light().bounce_irradiance);
  std::vector<const LitSurface*> surface_of_material(scene->materials.size(), nullptr);
  for (const LitSurface& surface : surfaces) {
    surface_of_material[surface.material] = &surface;
  }
  std::vector<const LitSurface*> surface_of_vertex(scene->mesh.vertices.size(), nullptr);
  for (const MeshTriangle& triangle : scene->mesh.triangles) {
    for (const uint32_t vertex : triangle.vertices) {
      surface_of_vertex[vertex] = surface_of_material[triangle.material];
    }
  }
  tbb::parallel_for(size_t{0}, surface_of_vertex.size(), [&](size_t i) {
    if (surface_of_vertex[i] == nullptr) {
      return;
    }
    MeshVertex& vertex = scene->mesh.vertices[i];
    const LitSurface::Point point = surface_of_vertex[i]->pointAt(vertex.u, vertex.v);
    float light = 0.0F;
    float open_light = 0.0F;
    // The same directions at all vertices: their error is then the same along the surface.
    for (int k = 0; k < rays_per_vertex; ++k) {
      const float u = (static_cast<float>(k) + 0.5F) / static_cast<float>(rays_per_vertex);
      const float v = std::fmod(0.61803399F * static_cast<float>(k), 1.0F);
      const Eigen::Vector3f direction = cosineDirection(point.normal, u, v);
      const bool is_up = direction.z() > 0.0F;
      const float full = is_up ? from_sky : from_ground;
      open_light += full;
      light += is_up && tracer.occluded(point.position + kLift_m * point.normal, direction, kSkyReach_m)
                   ? kOwnLight * full
                   : full;
    }
    vertex.ambient = open_light > 0.0F ? light / open_light : 1.0F;
  });
}

void bakeGroundLight(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m, double texel_m,
                     const std::function<double(double, double)>& ground_height, Scene* scene) {
  const RayTracer tracer(scene->mesh);
  const int width = static_cast<int>(std::lround((max_m.x() - min_m.x()) / texel_m));
  const int height = static_cast<int>(std::lround((max_m.y() - min_m.y()) / texel_m));
  const SunDisk sun(scene->sky->directionToSun());
  const auto pointAt = [&](double column, double row) {
    const double x = min_m.x() + (column + 0.5) * texel_m;
    const double y = min_m.y() + (row + 0.5) * texel_m;
    return Eigen::Vector3d(x, y, ground_height(x, y) + kLift_m).cast<float>().eval();
  };
  cv::Mat sun_image(height, width, CV_8UC1);
  tbb::parallel_for(0, height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      const Eigen::Vector3f direction = sun.direction(hashCell(column, row, 77));
      sun_image.at<uint8_t>(row, column) = tracer.occluded(pointAt(column, row), direction, kFar_m) ? 0 : 255;
    }
  });
  cv::GaussianBlur(sun_image, sun_image, cv::Size(3, 3), 0.7);

  cv::Mat sky_image(height / kSurroundingStride, width / kSurroundingStride, CV_8UC1);
  tbb::parallel_for(0, sky_image.rows, [&](int row) {
    for (int column = 0; column < sky_image.cols; ++column) {
      const Eigen::Vector3f point =
          pointAt((column + 0.5) * kSurroundingStride - 0.5, (row + 0.5) * kSurroundingStride - 0.5);
      const float free = freeSky(tracer, point, Eigen::Vector3f::UnitZ(), kSurroundingRays,
                                 hashCell(column, row, 78), kSkyReach_m);
      sky_image.at<uint8_t>(row, column) =
          cv::saturate_cast<uint8_t>(255.0F * (kOwnLight + (1.0F - kOwnLight) * free));
    }
  });
  cv::GaussianBlur(sky_image, sky_image, cv::Size(3, 3), 0.8);
  const auto scale = static_cast<float>(1.0 / texel_m);
  const auto x0 = static_cast<float>(min_m.x());
  const auto y0 = static_cast<float>(min_m.y());
  scene->ground.sun = std::make_unique<GroundTexture>(
      GroundTexture{Texture(sun_image, Texture::Border::kClamp), x0, y0, scale});
  scene->ground.surrounding = std::make_unique<GroundTexture>(
      GroundTexture{Texture(sky_image, Texture::Border::kClamp), x0, y0, scale / kSurroundingStride});
}

void bakeVertexAmbient(int rays_per_vertex, TriangleMesh* mesh) {
  TriangleMesh with_ground = *mesh;
  addQuad({-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0}, 0, &with_ground);
  const RayTracer tracer(with_ground);
  tbb::parallel_for(size_t{0}, mesh->vertices.size(), [&](size_t i) {
    MeshVertex& vertex = mesh->vertices[i];
    const Eigen::Vector3f start = vertex.position + 0.02F * vertex.normal;
    const float free =
        freeSky(tracer, start, vertex.normal, rays_per_vertex, mixBits(static_cast<uint32_t>(i)), 3.0F);
    // The open ground in the lower half of a wall's hemisphere does not count as occlusion.
    const float expected = 0.5F + 0.5F * vertex.normal.z();
    vertex.ambient = std::min(1.0F, free / std::max(0.1F, expected));
  });
}

}  // namespace vcharge
