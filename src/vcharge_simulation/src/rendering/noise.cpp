#include "vcharge_simulation/rendering/noise.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

float valueNoise(float x, float y, uint32_t seed) {
  const float floor_x = std::floor(x);
  const float floor_y = std::floor(y);
  const int ix = static_cast<int>(floor_x);
  const int iy = static_cast<int>(floor_y);
  const float fx = x - floor_x;
  const float fy = y - floor_y;
  const float wx = fx * fx * (3.0F - 2.0F * fx);
  const float wy = fy * fy * (3.0F - 2.0F * fy);
  const float v00 = cellValue(ix, iy, seed);
  const float v10 = cellValue(ix + 1, iy, seed);
  const float v01 = cellValue(ix, iy + 1, seed);
  const float v11 = cellValue(ix + 1, iy + 1, seed);
  const float v0 = v00 + (v10 - v00) * wx;
  const float v1 = v01 + (v11 - v01) * wx;
  return 2.0F * (v0 + (v1 - v0) * wy) - 1.0F;
}

float fractalNoise(float x, float y, int octaves, float gain, uint32_t seed) {
  float sum = 0.0F;
  float amplitude = 1.0F;
  float total = 0.0F;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += amplitude * valueNoise(x, y, seed + static_cast<uint32_t>(octave) * 101U);
    total += amplitude * amplitude;
    // The factor differs from 2 so that the lattices of the octaves do not align.
    x = x * 2.03F + 17.3F;
    y = y * 2.03F + 5.7F;
    amplitude *= gain;
  }
  return total > 0.0F ? sum / std::sqrt(total) : 0.0F;
}

CellNoise cellNoise(float x, float y, uint32_t seed) {
  const int ix = static_cast<int>(std::floor(x));
  const int iy = static_cast<int>(std::floor(y));
  float nearest = 1e9F;
  float second = 1e9F;
  uint32_t cell = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const uint32_t hash = hashCell(ix + dx, iy + dy, seed);
      const float px = static_cast<float>(ix + dx) + unitFromBits(hash);
      const float py = static_cast<float>(iy + dy) + unitFromBits(mixBits(hash + 1U));
      const float distance = std::hypot(px - x, py - y);
      if (distance < nearest) {
        second = nearest;
        nearest = distance;
        cell = hash;
      } else {
        second = std::min(second, distance);
      }
    }
  }
  return {0.5F * (second - nearest), cell};
}

uint64_t Random::bits() {
  state_ += 0x9E3779B97F4A7C15ULL;
  uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

double Random::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * 3.14159265358979323846 * uniform());
}

}  // namespace vcharge
