#include "files/pixel_hash.h"

#include <cmath>
#include <limits>
#include <vector>

namespace vcharge {

void addPixelsToHash(const cv::Mat& image, ContentHasher* hasher) {
  hasher->add(static_cast<int64_t>(image.cols));
  hasher->add(static_cast<int64_t>(image.rows));
  std::vector<float> row(static_cast<size_t>(image.cols * image.channels()));
  for (int y = 0; y < image.rows; ++y) {
    const float* in = image.ptr<float>(y);
    for (size_t x = 0; x < row.size(); ++x) {
      row[x] = std::isnan(in[x]) ? std::numeric_limits<float>::quiet_NaN() : in[x] + 0.0F;
    }
    hasher->addBytes(row.data(), row.size() * sizeof(float));
  }
}

}  // namespace vcharge
