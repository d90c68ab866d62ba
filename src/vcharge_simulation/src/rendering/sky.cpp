#include "vcharge_simulation/rendering/sky.h"

#include <algorithm>
#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr int kCloudTextureSize = 1024;
// Ratio of the sky's radiance seen by the camera to its light on the ground. As in the real images, the sky
// nearly saturates where the ground is well exposed.
constexpr float kGlare = 2.8F;

// Noise on a torus: blends four shifted copies so that the texture repeats without a seam.
float periodicNoise(float x, float y, float period, uint32_t seed) {
  const float wx = x / period;
  const float wy = y / period;
  const auto layer = [&](float dx, float dy) { return fractalNoise(x - dx, y - dy, 6, 0.55F, seed); };
  return (1 - wx) * (1 - wy) * layer(0, 0) + wx * (1 - wy) * layer(period, 0) +
         (1 - wx) * wy * layer(0, period) + wx * wy * layer(period, period);
}

Texture makeClouds(double cover, uint32_t seed) {
  cv::Mat image(kCloudTextureSize, kCloudTextureSize, CV_8UC1);
  const float threshold = static_cast<float>(0.6 - 1.2 * cover);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const float scale = 8.0F / kCloudTextureSize;
      const float noise =
          periodicNoise(static_cast<float>(x) * scale, static_cast<float>(y) * scale, 8.0F, seed);
      const float density = std::clamp((noise - threshold) * 1.4F, 0.0F, 1.0F);
      image.at<uint8_t>(y, x) = static_cast<uint8_t>(255.0F * density);
    }
  }
  return Texture(image, Texture::Border::kRepeat);
}

}  // namespace

Sky::Sky(const LightOptions& options, uint32_t seed)
    : light_(options), clouds_(makeClouds(options.cloud_cover, seed)) {
  const double c = std::cos(options.sun_elevation_rad);
  direction_to_sun_ =
      Eigen::Vector3d(c * std::cos(options.sun_azimuth_rad), c * std::sin(options.sun_azimuth_rad),
                      std::sin(options.sun_elevation_rad))
          .cast<float>();
}

float Sky::radiance(const Eigen::Vector3f& direction) const {
  const float z = std::max(direction.z(), 0.0F);
  const float inverse = 1.0F / (z + 0.12F);
  const float scale = 0.11F * kCloudTextureSize;
  // The level of detail grows towards the horizon, where the cloud layer is far away.
  const float level = 2.0F * fastLog2(1.0F + 0.35F * inverse);
  const float cloud = clouds_.sample(direction.x() * inverse * scale, direction.y() * inverse * scale, level);
  const float haze = (1.0F - z) * (1.0F - z) * (1.0F - z);
  const float clear = 0.42F + 0.65F * haze;
  const float towards_sun = 1.0F - direction.dot(direction_to_sun_);
  const float glow = 0.06F / (towards_sun + 0.012F);
  const float cloudy = 1.25F + 0.25F * haze + 0.5F * glow;
  return static_cast<float>(light_.sky_irradiance) * kGlare * (clear + cloud * (cloudy - clear) + glow);
}

}  // namespace vcharge
