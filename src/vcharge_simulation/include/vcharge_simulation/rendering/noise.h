#pragma once

#include <cstdint>

namespace vcharge {

/// Well-mixed 32 bits of a 32-bit number (the finalizer of MurmurHash3).
inline uint32_t mixBits(uint32_t bits) {
  bits ^= bits >> 16;
  bits *= 0x85EBCA6BU;
  bits ^= bits >> 13;
  bits *= 0xC2B2AE35U;
  bits ^= bits >> 16;
  return bits;
}

/// Hash of a grid cell; the same on every machine.
inline uint32_t hashCell(int x, int y, uint32_t seed) {
  return mixBits(static_cast<uint32_t>(x) * 0x9E3779B1U ^
                 mixBits(static_cast<uint32_t>(y) + seed * 0x7FEB352DU));
}

/// 24 bits of a hash as a number in [0, 1).
inline float unitFromBits(uint32_t bits) {
  return static_cast<float>(bits >> 8) * (1.0F / 16777216.0F);
}

/// Number in [0, 1) of a grid cell.
inline float cellValue(int x, int y, uint32_t seed) {
  return unitFromBits(hashCell(x, y, seed));
}

/// Smooth noise in [-1, 1] with features of about one unit.
float valueNoise(float x, float y, uint32_t seed);

/// Sum of `octaves` of valueNoise, each at twice the frequency and `gain` times the amplitude of the one
/// before; about [-1, 1].
float fractalNoise(float x, float y, int octaves, float gain, uint32_t seed);

/// Distance to the border between the two nearest of the random points, one per unit cell, and which point is
/// nearest.
struct CellNoise {
  float border_distance;
  uint32_t cell;  ///< hash of the nearest point's cell
};
CellNoise cellNoise(float x, float y, uint32_t seed);

/// A small generator (SplitMix64) whose numbers do not depend on the standard library.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  uint64_t bits();
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * (1.0 / 9007199254740992.0); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// In [0, count).
  int index(int count) { return static_cast<int>(uniform() * count); }
  bool chance(double probability) { return uniform() < probability; }
  /// Mean 0, standard deviation 1 (Box and Muller).
  double normal();

 private:
  uint64_t state_;
};

}  // namespace vcharge
