#include "kernels/packed_image.h"

#include <algorithm>
#include <limits>

#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"
#include "kernels/sweep_kernels.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kCellsPerLine = 16;  // cells per cache line

/// Cells per row: an odd number of cache lines, because rows a power of two apart would compete for few cache
/// sets.
int pitchOf(int width) {
  const int lines = (width + kCellsPerLine - 1) / kCellsPerLine;
  return kCellsPerLine * (lines | 1);
}

}  // namespace

PackedImage::PackedImage(const cv::Mat& pixels, const cv::Mat& valid_mask)
    : size_(pixels.cols + 2 * kMargin, pixels.rows + 2 * kMargin), pitch_(pitchOf(size_.width)) {
  check(std::max(pitch_, size_.height) <= std::numeric_limits<int16_t>::max(),
        "PackedImage: an image may have at most 32,000 pixels a side");
  const auto pitch = static_cast<size_t>(pitch_);
  const SweepKernels kernels = sweepKernels();
  cells_ = pooledMat({pitch_, size_.height}, CV_32SC1);
  forEachRow(size_.height, [&](int row) {
    auto* cells = cells_.ptr<int32_t>(row);
    std::fill_n(cells, pitch, kUnseenCell);
    const int y = row - kMargin;
    if (y < 0 || y + 1 >= pixels.rows) {
      return;
    }
    const auto* top = pixels.ptr<uint8_t>(y);
    const auto* bottom = pixels.ptr<uint8_t>(y + 1);
    const auto* top_valid = valid_mask.ptr<uint8_t>(y);
    const auto* bottom_valid = valid_mask.ptr<uint8_t>(y + 1);
    cells += kMargin;
    kernels.packCells({top, bottom, top_valid, bottom_valid}, static_cast<size_t>(pixels.cols - 1), cells);
  });
}

}  // namespace vcharge
