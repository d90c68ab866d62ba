#include "extraction/brief_descriptor.h"

#include <cmath>
#include <random>

#include <opencv2/core/hal/interface.h>

namespace vcharge {
namespace {

struct Offset {
  int x, y;
};
using Pattern = std::array<std::array<Offset, 2>, BriefDescriptor::kBits>;

/// Sum of four uniform integers: close to a normal distribution with a standard deviation of 6.0. (Calonder's
/// fifth of the patch size would be 6.2.)
int drawCoordinate(std::mt19937* generator) {
  int sum = 0;
  for (int i = 0; i < 4; ++i) {
    sum += static_cast<int>((*generator)() % 11U) - 5;
  }
  return sum;
}

Offset drawOffset(std::mt19937* generator) {
  constexpr int kRadius = BriefDescriptor::kRadius_px;  // the circle is half a pixel smaller
  while (true) {
    const int x = drawCoordinate(generator);
    const int y = drawCoordinate(generator);
    if (4 * (x * x + y * y) <= (2 * kRadius - 1) * (2 * kRadius - 1)) {
      return {x, y};
    }
  }
}

Pattern makePattern() {
  std::mt19937 generator(1);
  Pattern pattern;
  for (auto& pair : pattern) {
    do {
      pair = {drawOffset(&generator), drawOffset(&generator)};
    } while (pair[0].x == pair[1].x && pair[0].y == pair[1].y);
  }
  return pattern;
}

}  // namespace

BriefDescriptor::BriefDescriptor(int64_t step) {
  static const Pattern kPattern = makePattern();
  for (int i = 0; i < kBits; ++i) {
    const auto& [first, second] = kPattern[i];
    offsets_[i] = {first.y * step + first.x, second.y * step + second.x};
  }
}

void BriefDescriptor::describe(const uint8_t* centre, uint8_t* descriptor) const {
  for (int byte = 0; byte < kBytes; ++byte) {
    unsigned bits = 0;
    for (int i = 0; i < 8; ++i) {
      const PixelPair& pair = offsets_[8 * byte + i];
      bits |= static_cast<unsigned>(centre[pair.first] < centre[pair.second]) << i;
    }
    descriptor[byte] = static_cast<uint8_t>(bits);
  }
}

}  // namespace vcharge
