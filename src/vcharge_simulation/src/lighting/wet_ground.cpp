#include "lighting/wet_ground.h"

#include <algorithm>
#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr float kRefractiveIndex = 1.33F;
constexpr float kPuddleSize_m = 3.5F;
constexpr float kWetAsphalt = 0.55F;  // reflectance relative to dry asphalt
constexpr float kFilm = 0.35F;        // fraction of the surface between puddles that is smooth
constexpr float kLevelNormal_z = 0.998F;
constexpr float kFilmSlope = 0.02F;
constexpr float kPuddleSlope = 0.002F;
constexpr float kRipple_m = 0.07F;

}  // namespace

float waterReflectance(float cosine) {
  const float a = std::clamp(cosine, 0.0F, 1.0F);
  const float b = std::sqrt(1.0F - (1.0F - a * a) / (kRefractiveIndex * kRefractiveIndex));
  const float s = (a - kRefractiveIndex * b) / (a + kRefractiveIndex * b);
  const float p = (b - kRefractiveIndex * a) / (b + kRefractiveIndex * a);
  return 0.5F * (s * s + p * p);
}

Water waterAt(const Eigen::Vector3f& position, const Eigen::Vector3f& ground_normal, float wetness,
              float footprint_m) {
  const float noise = fractalNoise(position.x() / kPuddleSize_m, position.y() / kPuddleSize_m, 4, 0.5F, 61U);
  const float threshold = 0.6F - 0.4F * wetness;
  const float puddle = ground_normal.z() > kLevelNormal_z ? ramp(noise, threshold, threshold + 0.06F) : 0.0F;
  Water water;
  water.darkening = 1.0F - (1.0F - kWetAsphalt) * wetness;
  water.mirror = puddle + (1.0F - puddle) * kFilm * wetness;
  const float resolved = std::min(1.0F, kRipple_m / std::max(1e-6F, footprint_m));
  const float slope = resolved * (kFilmSlope + puddle * (kPuddleSlope - kFilmSlope));
  const float x = position.x() / kRipple_m;
  const float y = position.y() / kRipple_m;
  water.normal = (ground_normal + slope * Eigen::Vector3f(valueNoise(x, y, 62U), valueNoise(x, y, 63U), 0.0F))
                     .normalized();
  return water;
}

}  // namespace vcharge
