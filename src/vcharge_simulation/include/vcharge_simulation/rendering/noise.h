#pragma once

#include <algorithm>
#include <cstdint>

namespace vcharge {

/// Finalizer of MurmurHash3: mixes all bits of a 32-bit number.
inline uint32_t mixBits(uint32_t bits) {
  bits ^= bits >> 16;
  bits *= 0x85EBCA6BU;
  bits ^= bits >> 13;
  bits *= 0xC2B2AE35U;
  bits ^= bits >> 16;
  return bits;
}

/// Hash of a grid cell, identical on every machine.
inline uint32_t hashCell(int x, int y, uint32_t seed) {
  return mixBits(static_cast<uint32_t>(x) * 0x9E3779B1U ^
                 mixBits(static_cast<uint32_t>(y) + seed * 0x7FEB352DU));
}

/// Maps the upper 24 bits of a hash to [0, 1).
inline float unitFromBits(uint32_t bits) {
  return static_cast<float>(bits >> 8) * (1.0F / 16777216.0F);
}

/// Pseudo-random number in [0, 1) of a grid cell.
inline float cellValue(int x, int y, uint32_t seed) {
  return unitFromBits(hashCell(x, y, seed));
}

/// 0 up to `low`, 1 from `high` on, linear between.
inline float ramp(float value, float low, float high) {
  return std::clamp((value - low) / (high - low), 0.0F, 1.0F);
}

/// Smooth noise in [-1, 1] with features of about one unit.
float valueNoise(float x, float y, uint32_t seed);

/// Sum of `octaves` of valueNoise, each with twice the frequency and `gain` times the amplitude of the
/// previous one; roughly in [-1, 1].
float fractalNoise(float x, float y, int octaves, float gain, uint32_t seed);

/// Cellular noise with one random point per unit cell: distance to the border between the two nearest points,
/// and the cell of the nearest.
struct CellNoise {
  float border_distance;
  uint32_t cell;  ///< hash of the nearest point's cell
};
CellNoise cellNoise(float x, float y, uint32_t seed);

/// Random number generator (SplitMix64) with the same sequence on every platform.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  uint64_t bits();
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * (1.0 / 9007199254740992.0); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in [0, count).
  int index(int count) { return static_cast<int>(uniform() * count); }
  bool chance(double probability) { return uniform() < probability; }
  /// Standard normal distribution (Box and Muller).
  double normal();

 private:
  uint64_t state_;
};

}  // namespace vcharge
