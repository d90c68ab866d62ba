#include "vcharge_simulation/rendering/sky.h"

#include <algorithm>
#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr int kCloudTextureSize = 1024;
constexpr float kCloudPeriod = 8.0F;  // period of the noise, in cells of its lowest octave
// Ratio of the sky's radiance seen by the camera to its light on the ground. As in the real images, the sky
// nearly saturates where the ground is well exposed.
constexpr float kSeenToLighting = 2.8F;
// The clouds lie in a plane above the viewer. This keeps their distance finite at the horizon.
constexpr float kHorizonElevation = 0.12F;
constexpr float kTexturesPerHeight = 0.11F;  // repetitions of the texture per height of the clouds

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
      const float scale = kCloudPeriod / kCloudTextureSize;
      const float noise =
          periodicNoise(static_cast<float>(x) * scale, static_cast<float>(y) * scale, kCloudPeriod, seed);
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
  const float distance = 1.0F / (z + kHorizonElevation);  // to the clouds, relative to their height
  const float scale = kTexturesPerHeight * kCloudTextureSize;
  // Distant clouds are sampled from coarser levels of the texture.
  const float level = 2.0F * fastLog2(1.0F + 0.35F * distance);
  const float cloud =
      clouds_.sample(direction.x() * distance * scale, direction.y() * distance * scale, level);
  // Relative radiances: the sky brightens towards the horizon, around the sun and in clouds.
  const float haze = (1.0F - z) * (1.0F - z) * (1.0F - z);
  const float clear = 0.42F + 0.65F * haze;
  const float from_sun = 1.0F - direction.dot(direction_to_sun_);  // 0 towards the sun
  const float glow = static_cast<float>(light_.sun_glow) * 0.06F / (from_sun + 0.012F);
  const float cloudy = 1.25F + 0.25F * haze + 0.5F * glow;
  return static_cast<float>(light_.sky_irradiance) * kSeenToLighting *
         (clear + cloud * (cloudy - clear) + glow);
}

}  // namespace vcharge
