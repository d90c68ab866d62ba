#include "vcharge_core/range_map.h"

#include <cmath>
#include <limits>
#include <vector>

namespace vcharge {
namespace {

void addPixels(const cv::Mat& image, ContentHasher* hasher) {
  hasher->add(static_cast<int64_t>(image.cols));
  hasher->add(static_cast<int64_t>(image.rows));
  std::vector<float> row(image.cols);
  for (int y = 0; y < image.rows; ++y) {
    const float* in = image.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      row[x] = std::isnan(in[x]) ? std::numeric_limits<float>::quiet_NaN() : in[x] + 0.0F;
    }
    hasher->addBytes(row.data(), row.size() * sizeof(float));
  }
}

}  // namespace

void addToHash(const RangeMap& map, ContentHasher* hasher) {
  hasher->add(map.stamp.nanoseconds());
  hasher->add(map.camera_name);
  hasher->add(map.frame_id);
  const MeiCamera::Parameters parameters = map.camera.parameters();
  for (int i = 0; i < MeiCamera::kNumParameters; ++i) {
    hasher->add(parameters[i]);
  }
  addPixels(map.range_m, hasher);
  addPixels(map.standard_deviation_m, hasher);
  addPixels(map.confidence, hasher);
}

}  // namespace vcharge
