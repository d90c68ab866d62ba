#include "packed_image.h"

#include <algorithm>

#include "sweep_kernels.h"

namespace vcharge {
namespace {

/// Two pixels of a column as the low half of a cell.
inline uint32_t columnBytes(const uint8_t* top, const uint8_t* bottom, int x) {
  const auto signedByte = [](uint8_t gray) { return static_cast<uint32_t>(std::max<int>(gray, 1)) ^ 0x80u; };
  return signedByte(top[x]) | signedByte(bottom[x]) << 8;
}

}  // namespace

PackedImage::PackedImage(const cv::Mat& pixels, const cv::Mat& valid_mask)
    : size_(pixels.cols + 2 * kMargin, pixels.rows + 2 * kMargin), pitch_shift_(2) {
  while ((1 << pitch_shift_) < 4 * size_.width) {
    ++pitch_shift_;
  }
  const size_t pitch = (size_t{1} << pitch_shift_) / sizeof(int32_t);
  cells_.assign(pitch * static_cast<size_t>(size_.height), kUnseenCell);
  for (int y = 0; y + 1 < pixels.rows; ++y) {
    const auto* top = pixels.ptr<uint8_t>(y);
    const auto* bottom = pixels.ptr<uint8_t>(y + 1);
    const auto* top_valid = valid_mask.ptr<uint8_t>(y);
    const auto* bottom_valid = valid_mask.ptr<uint8_t>(y + 1);
    int32_t* cells = cells_.data() + static_cast<size_t>(y + kMargin) * pitch + kMargin;
    for (int x = 0; x + 1 < pixels.cols; ++x) {
      const bool seen =
          (top_valid[x] != 0) & (bottom_valid[x] != 0) & (top_valid[x + 1] != 0) & (bottom_valid[x + 1] != 0);
      const uint32_t cell = columnBytes(top, bottom, x) | columnBytes(top, bottom, x + 1) << 16;
      cells[x] = seen ? static_cast<int32_t>(cell) : kUnseenCell;
    }
  }
}

}  // namespace vcharge
