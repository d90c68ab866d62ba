#include "extraction/brief_descriptor.h"

#include <cmath>
#include <random>

#include <opencv2/core/hal/interface.h>

namespace vcharge {
namespace {

constexpr double kTwoPi = 6.28318530717958647692;

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
  constexpr int kRadius = BriefDescriptor::kRadius_px;
  while (true) {
    const int x = drawCoordinate(generator);
    const int y = drawCoordinate(generator);
    // Half a pixel is kept for the rounding of turned offsets.
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
  for (int a = 0; a < kNumAngles; ++a) {
    const double cosine = std::cos(kTwoPi * a / kNumAngles);
    const double sine = std::sin(kTwoPi * a / kNumAngles);
    const auto turned = [&](const Offset& offset) {
      const int64_t x = std::lround(cosine * offset.x - sine * offset.y);
      const int64_t y = std::lround(sine * offset.x + cosine * offset.y);
      return y * step + x;
    };
    for (int i = 0; i < kBits; ++i) {
      offsets_[a][i] = {turned(kPattern[i][0]), turned(kPattern[i][1])};
    }
  }
}

void BriefDescriptor::describe(const uint8_t* centre, float angle_rad, uint8_t* descriptor) const {
  const int64_t step = std::lround(angle_rad * (kNumAngles / kTwoPi));
  const auto& offsets = offsets_[((step % kNumAngles) + kNumAngles) % kNumAngles];
  for (int byte = 0; byte < kBytes; ++byte) {
    unsigned bits = 0;
    for (int i = 0; i < 8; ++i) {
      const PixelPair& pair = offsets[8 * byte + i];
      bits |= static_cast<unsigned>(centre[pair.first] < centre[pair.second]) << i;
    }
    descriptor[byte] = static_cast<uint8_t>(bits);
  }
}

float BriefDescriptor::intensityCentroidAngle(const uint8_t* centre, int64_t step) {
  int64_t moment_x = 0, moment_y = 0;
  for (int y = -kRadius_px; y <= kRadius_px; ++y) {
    const int half_width = static_cast<int>(std::sqrt(kRadius_px * kRadius_px - y * y));
    const uint8_t* row = centre + y * step;
    int sum = 0;
    for (int x = -half_width; x <= half_width; ++x) {
      sum += row[x];
      moment_x += x * row[x];
    }
    moment_y += y * sum;
  }
  const double angle = std::atan2(static_cast<double>(moment_y), static_cast<double>(moment_x));
  const auto wrapped = static_cast<float>(angle < 0.0 ? angle + kTwoPi : angle);
  return wrapped < static_cast<float>(kTwoPi) ? wrapped : 0.0F;
}

}  // namespace vcharge
