#include "lighting/lamp_light.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr float kTwoPi = 6.28318531F;
constexpr float kLift_m = 0.012F;
// Shadow rays end before the housing of the lamp.
constexpr float kHousing_m = 0.16F;
constexpr float kUpwardFraction = 0.2F;
constexpr float kSidewardFraction = 0.25F;
constexpr float kFloor_m = 0.03F;
constexpr int kGatherStride = 5;

class LampBaker {
 public:
  LampBaker(const std::vector<Lamp>& lamps, const LampOptions& options, const TriangleMesh& mesh)
      : lamps_(lamps), options_(options), tracer_(mesh) {}

  float direct(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, uint32_t hash) const {
    float sum = 0.0F;
    for (size_t i = 0; i < lamps_.size(); ++i) {
      const Lamp& lamp = lamps_[i];
      const Eigen::Vector3f to_lamp = lamp.centre - position;
      if (to_lamp.squaredNorm() > lamp.reach_m * lamp.reach_m ||
          normal.dot(to_lamp) + lamp.half_length.norm() <= 0.0F) {
        continue;
      }
      for (int k = 0; k < options_.rays_per_lamp; ++k) {
        const uint32_t bits = mixBits(hash + static_cast<uint32_t>(i) * 64U + static_cast<uint32_t>(k) * 7U);
        const float along =
            (static_cast<float>(k) + unitFromBits(bits)) / static_cast<float>(options_.rays_per_lamp);
        const Eigen::Vector3f offset = to_lamp + (2.0F * along - 1.0F) * lamp.half_length;
        const float irradiance = lampIrradiance(lamp, offset, normal);
        if (irradiance <= 0.0F) {
          continue;
        }
        const float distance = offset.norm();
        const Eigen::Vector3f direction = offset / distance;
        if (!tracer_.occluded(position + kLift_m * normal, direction,
                              std::max(0.01F, distance - kHousing_m))) {
          sum += irradiance;
        }
      }
    }
    return sum / static_cast<float>(options_.rays_per_lamp);
  }

  // Indirect light from the floor and other lit surfaces.
  float gathered(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, uint32_t hash,
                 const GroundTexture* floor) const {
    const Eigen::Vector3f side = normal.unitOrthogonal();
    const Eigen::Vector3f other = normal.cross(side);
    float sum = 0.0F;
    const int rays = options_.gathered_rays;
    for (int i = 0; i < rays; ++i) {
      const float u = (static_cast<float>(i) + unitFromBits(mixBits(hash + 2U * static_cast<uint32_t>(i)))) /
                      static_cast<float>(rays);
      const float v = std::fmod(0.61803399F * static_cast<float>(i) + unitFromBits(hash), 1.0F);
      const float r = std::sqrt(u);
      const Eigen::Vector3f direction =
          (r * std::cos(kTwoPi * v) * side + r * std::sin(kTwoPi * v) * other + std::sqrt(1.0F - u) * normal)
              .normalized();
      RayTracer::Hit hit;
      const Eigen::Vector3f start = position + kLift_m * normal;
      if (!tracer_.cast(start, direction, &hit)) {
        continue;
      }
      const Eigen::Vector3f point = start + hit.distance_m * direction;
      // Nearby surfaces in corners under cars and behind pillars are dark themselves.
      const float nearness = std::min(1.0F, hit.distance_m / 0.5F);
      sum += floor != nullptr && point.z() < kFloor_m
                 ? static_cast<float>(options_.floor_albedo) * floor->sampleAt(point.x(), point.y(), 1.0F)
                 : static_cast<float>(options_.other_radiance) * nearness;
    }
    return sum / static_cast<float>(rays);
  }

 private:
  const std::vector<Lamp>& lamps_;
  const LampOptions& options_;
  const RayTracer tracer_;
};

GroundTexture mapOf(const cv::Mat& irradiance, const Eigen::Vector2d& min_m, double texel_m) {
  cv::Mat image;
  irradiance.convertTo(image, CV_8UC1, 255.0);
  return {Texture(image, Texture::Border::kClamp), static_cast<float>(min_m.x()),
          static_cast<float>(min_m.y()), static_cast<float>(1.0 / texel_m)};
}

}  // namespace

float lampIrradiance(const Lamp& lamp, const Eigen::Vector3f& to_lamp, const Eigen::Vector3f& normal) {
  const float distance = to_lamp.norm();
  const Eigen::Vector3f direction = to_lamp / distance;
  const float cosine = normal.dot(direction);
  if (cosine <= 0.0F || distance >= lamp.reach_m) {
    return 0.0F;
  }
  const float near = std::max(distance, 0.4F);
  const float fade = 1.0F - distance * distance / (lamp.reach_m * lamp.reach_m);
  const float downward =
      direction.z() > 0.0F ? kSidewardFraction + (1.0F - kSidewardFraction) * direction.z() : kUpwardFraction;
  return lamp.intensity * downward * cosine * fade * fade / (near * near);
}

void bakeGroundLamps(const Eigen::Vector2d& min_m, const Eigen::Vector2d& max_m, double texel_m,
                     const std::function<double(double, double)>& ground_height, Scene* scene) {
  if (scene->lamps.empty()) {
    return;
  }
  LampOptions options;
  options.rays_per_lamp = 1;
  const LampBaker baker(scene->lamps, options, scene->mesh);
  cv::Mat root(static_cast<int>(std::lround((max_m.y() - min_m.y()) / texel_m)),
               static_cast<int>(std::lround((max_m.x() - min_m.x()) / texel_m)), CV_32FC1);
  tbb::parallel_for(0, root.rows, [&](int row) {
    for (int column = 0; column < root.cols; ++column) {
      const double x = min_m.x() + (column + 0.5) * texel_m;
      const double y = min_m.y() + (row + 0.5) * texel_m;
      const Eigen::Vector3f position = Eigen::Vector3d(x, y, ground_height(x, y)).cast<float>();
      root.at<float>(row, column) =
          std::sqrt(baker.direct(position, Eigen::Vector3f::UnitZ(), hashCell(column, row, 93)));
    }
  });
  cv::GaussianBlur(root, root, cv::Size(3, 3), 0.7);
  double brightest = 0.0;
  cv::minMaxLoc(root, nullptr, &brightest);
  scene->ground.max_lamp_irradiance = static_cast<float>(brightest * brightest);
  scene->ground.lamps =
      std::make_unique<GroundTexture>(mapOf(root / std::max(1e-12, brightest), min_m, texel_m));
}

void bakeLampLight(const std::vector<Lamp>& lamps, const LampOptions& options, const Eigen::Vector2d& min_m,
                   const Eigen::Vector2d& max_m, Scene* scene) {
  const LampBaker baker(lamps, options, scene->mesh);
  const double texel_m = options.floor_texel_m;
  const int width = static_cast<int>(std::lround((max_m.x() - min_m.x()) / texel_m));
  const int height = static_cast<int>(std::lround((max_m.y() - min_m.y()) / texel_m));
  const auto positionAt = [&](int column, int row, double stride) {
    return Eigen::Vector3d(min_m.x() + (column + 0.5) * stride * texel_m,
                           min_m.y() + (row + 0.5) * stride * texel_m, 0.0)
        .cast<float>()
        .eval();
  };
  cv::Mat floor(height, width, CV_32FC1);
  tbb::parallel_for(0, height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      floor.at<float>(row, column) =
          baker.direct(positionAt(column, row, 1.0), Eigen::Vector3f::UnitZ(), hashCell(column, row, 91));
    }
  });
  cv::GaussianBlur(floor, floor, cv::Size(5, 5), 1.0);
  const GroundTexture direct_map = mapOf(floor, min_m, texel_m);
  cv::Mat gathered(height / kGatherStride, width / kGatherStride, CV_32FC1);
  tbb::parallel_for(0, gathered.rows, [&](int row) {
    for (int column = 0; column < gathered.cols; ++column) {
      gathered.at<float>(row, column) =
          baker.gathered(positionAt(column, row, kGatherStride), Eigen::Vector3f::UnitZ(),
                         hashCell(column, row, 92), nullptr);
    }
  });
  cv::GaussianBlur(gathered, gathered, cv::Size(3, 3), 0.8);
  cv::resize(gathered, gathered, floor.size(), 0, 0, cv::INTER_LINEAR);
  floor += gathered;
  tbb::parallel_for(size_t{0}, scene->mesh.vertices.size(), [&](size_t i) {
    MeshVertex& vertex = scene->mesh.vertices[i];
    const uint32_t hash = mixBits(static_cast<uint32_t>(i));
    vertex.ambient = baker.direct(vertex.position, vertex.normal, hash) +
                     baker.gathered(vertex.position, vertex.normal, hash + 5U, &direct_map);
  });
  scene->ground.surrounding = std::make_unique<GroundTexture>(mapOf(floor, min_m, texel_m));
}

}  // namespace vcharge
