#include "vcharge_simulation/rendering/texture.h"

#include <cstring>

#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

bool isPowerOfTwo(int value) {
  return value > 0 && (value & (value - 1)) == 0;
}

}  // namespace

Texture::Texture(const cv::Mat& image, Border border) : border_(border) {
  check(!image.empty() && image.type() == CV_8UC1, "Texture: expected a CV_8UC1 image");
  check(border == Border::kClamp || (isPowerOfTwo(image.cols) && isPowerOfTwo(image.rows)),
        "Texture: sides of a repeated texture must be powers of two");
  size_t total = 0;
  for (int width = image.cols, height = image.rows;;) {
    levels_.push_back({total, width, height, static_cast<float>(width) / static_cast<float>(image.cols),
                       static_cast<float>(height) / static_cast<float>(image.rows)});
    total += static_cast<size_t>(width) * static_cast<size_t>(height);
    if (width == 1 && height == 1) {
      break;
    }
    width = (width + 1) / 2;
    height = (height + 1) / 2;
  }
  texels_.resize(total);
  for (int y = 0; y < image.rows; ++y) {
    std::memcpy(texels_.data() + static_cast<size_t>(y) * image.cols, image.ptr(y),
                static_cast<size_t>(image.cols));
  }
  for (size_t i = 1; i < levels_.size(); ++i) {
    const Level& fine = levels_[i - 1];
    const Level& coarse = levels_[i];
    for (int y = 0; y < coarse.height; ++y) {
      const uint8_t* row0 = texels_.data() + fine.offset + static_cast<size_t>(2 * y) * fine.width;
      const uint8_t* row1 = 2 * y + 1 < fine.height ? row0 + fine.width : row0;
      uint8_t* out = texels_.data() + coarse.offset + static_cast<size_t>(y) * coarse.width;
      for (int x = 0; x < coarse.width; ++x) {
        const int x0 = 2 * x;
        const int x1 = x0 + 1 < fine.width ? x0 + 1 : x0;
        out[x] = static_cast<uint8_t>((row0[x0] + row0[x1] + row1[x0] + row1[x1] + 2) / 4);
      }
    }
  }
}

}  // namespace vcharge
