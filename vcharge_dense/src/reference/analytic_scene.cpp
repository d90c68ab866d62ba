#include "reference/analytic_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kNumWaves = 40;
constexpr double kShortestWave_m = 0.04;
constexpr double kLongestWave_m = 1.5;

double uniformNumber(std::mt19937* generator) {
  return (static_cast<double>((*generator)()) + 0.5) / 4294967296.0;
}

}  // namespace

double normalNumber(std::mt19937* generator) {
  const double radius = std::sqrt(-2.0 * std::log(uniformNumber(generator)));
  return radius * std::cos(2.0 * kPi * uniformNumber(generator));
}

AnalyticScene::AnalyticScene(std::vector<Patch> patches, uint32_t seed) : patches_(std::move(patches)) {
  std::mt19937 generator(seed);
  for (int i = 0; i < kNumWaves; ++i) {
    const double length_m = kShortestWave_m * std::pow(kLongestWave_m / kShortestWave_m,
                                                       static_cast<double>(i) / (kNumWaves - 1));
    const double x = normalNumber(&generator), y = normalNumber(&generator), z = normalNumber(&generator);
    const Eigen::Vector3d direction = Eigen::Vector3d(x, y, z).normalized();
    waves_.push_back({2.0 * kPi / length_m * direction, 2.0 * kPi * uniformNumber(&generator), 9.0});
  }
}

AnalyticScene::Hit AnalyticScene::intersect(const Eigen::Vector3d& origin,
                                            const Eigen::Vector3d& direction) const {
  Hit hit{std::numeric_limits<double>::quiet_NaN(), 0.0, 1.0};
  for (const Patch& patch : patches_) {
    const double along = patch.normal.dot(direction);
    const double range_m = patch.normal.dot(patch.centre - origin) / along;
    const Eigen::Vector3d offset = origin + range_m * direction - patch.centre;
    const bool inside = (offset.cwiseAbs().array() <= patch.half_size_m.array() + 1e-9).all();
    if (range_m > 1e-6 && inside && !(range_m >= hit.range_m)) {
      hit = {range_m, patch.contrast, std::abs(along) / patch.normal.norm()};
    }
  }
  return hit;
}

cv::Mat AnalyticScene::range(const MeiCamera& camera, cv::Size size,
                             const RigidTransform& world_from_camera) const {
  return range(camera, size, [&](int) { return world_from_camera; });
}

cv::Mat AnalyticScene::range(const MeiCamera& camera, cv::Size size,
                             const PoseOfRow& world_from_camera) const {
  cv::Mat range(size, CV_64FC1, cv::Scalar(std::numeric_limits<double>::quiet_NaN()));
  for (int y = 0; y < size.height; ++y) {
    const RigidTransform pose = world_from_camera(y);
    for (int x = 0; x < size.width; ++x) {
      Eigen::Vector3d ray;
      if (camera.unproject(Eigen::Vector2d(x, y), &ray)) {
        range.at<double>(y, x) = intersect(pose.translation(), pose.rotation() * ray).range_m;
      }
    }
  }
  return range;
}

cv::Mat AnalyticScene::render(const MeiCamera& camera, cv::Size size, const RigidTransform& world_from_camera,
                              double noise_gray_levels, uint32_t noise_seed) const {
  return render(
      camera, size, [&](int) { return world_from_camera; }, noise_gray_levels, noise_seed);
}

cv::Mat AnalyticScene::render(const MeiCamera& camera, cv::Size size, const PoseOfRow& world_from_camera,
                              double noise_gray_levels, uint32_t noise_seed) const {
  std::mt19937 generator(noise_seed);
  const double pixel_rad = (1.0 + camera.xi()) / camera.gamma1();
  cv::Mat image(size, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < size.height; ++y) {
    const RigidTransform pose = world_from_camera(y);
    for (int x = 0; x < size.width; ++x) {
      Eigen::Vector3d ray;
      double gray = 120.0;
      if (camera.unproject(Eigen::Vector2d(x, y), &ray)) {
        const Eigen::Vector3d direction = pose.rotation() * ray;
        const Hit hit = intersect(pose.translation(), direction);
        if (std::isfinite(hit.range_m) && hit.contrast > 0.0) {
          const Eigen::Vector3d point = pose.translation() + hit.range_m * direction;
          // Gaussian pixel footprint of half a pixel's width, longer on slanted surfaces.
          const double width_m = 0.5 * hit.range_m * pixel_rad / std::sqrt(std::max(0.05, hit.cos_incidence));
          for (const Wave& wave : waves_) {
            const double fade = std::exp(-0.5 * wave.frequency.squaredNorm() * width_m * width_m);
            gray += hit.contrast * wave.amplitude * fade * std::sin(wave.frequency.dot(point) + wave.phase);
          }
        }
      }
      gray += noise_gray_levels > 0.0 ? noise_gray_levels * normalNumber(&generator) : 0.0;
      image.at<uint8_t>(y, x) = static_cast<uint8_t>(std::clamp(std::lround(gray), 0L, 255L));
    }
  }
  return image;
}

}  // namespace vcharge
