#include "objects/clothing.h"

#include <cmath>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr int kWidth_px = 96;
constexpr int kHeight_px = 128;

// Whether a texel has the second colour.
bool isOnPattern(int pattern, int x, int y, uint32_t seed) {
  const auto fx = static_cast<float>(x);
  const auto fy = static_cast<float>(y);
  switch (pattern) {
    case 1:
      return y / 10 % 2 == 0;
    case 2:
      return x / 6 % 2 == 0;
    case 3:
      return (x / 12 + y / 12) % 2 == 0;
    case 4:
      return std::hypot(x % 16 - 8, y % 16 - 8) < 4.5;
    case 5:
      return fractalNoise(0.06F * fx, 0.06F * fy, 2, 0.5F, seed) > 0.1F;
    default:
      return false;
  }
}

}  // namespace

cv::Mat drawCloth(int pattern, double tone, uint32_t seed) {
  const double other = tone < 0.25 ? tone + 0.35 : 0.35 * tone;
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const float weave =
          fractalNoise(0.12F * static_cast<float>(x), 0.1F * static_cast<float>(y), 4, 0.75F, seed + 1U);
      const double colour = isOnPattern(pattern, x, y, seed) ? other : tone;
      image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0 * colour * (1.0 + 0.3 * weave));
    }
  }
  return image;
}

}  // namespace vcharge
