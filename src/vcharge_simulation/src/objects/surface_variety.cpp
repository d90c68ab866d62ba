#include "objects/surface_variety.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

// The middle of each range is near what the published V-Charge images of a street and of a workshop show.
SurfaceVariety SurfaceVariety::outdoors(uint64_t seed) {
  SurfaceVariety variety;
  if (seed != 0) {
    Random random(seed * 7717U + 19U);
    variety.grain = random.uniform(2.05, 2.75);
    variety.pattern = random.uniform(0.35, 0.9);
    variety.leaf = random.uniform(0.45, 0.75);
    variety.grain_size = random.uniform(0.55, 0.7);
    variety.has_coarse_grain = true;
    variety.relief_m = random.uniform(0.05, 0.07);
    variety.foliage = random.uniform(0.25, 0.45);
  }
  return variety;
}

SurfaceVariety SurfaceVariety::indoors(uint64_t seed) {
  SurfaceVariety variety;
  if (seed != 0) {
    Random random(seed * 7717U + 19U);
    variety.grain = random.uniform(0.5, 0.9);
    variety.pattern = random.uniform(0.35, 0.9);
    variety.grain_size = random.uniform(0.55, 0.7);
    variety.relief_m = random.uniform(0.005, 0.015);
  }
  return variety;
}

void SurfaceVariety::fade(double texels_per_m, cv::Mat* texture) const {
  if (pattern == 1.0) {
    return;
  }
  const cv::Size coarse(std::max(1, static_cast<int>(texture->cols / texels_per_m)),
                        std::max(1, static_cast<int>(texture->rows / texels_per_m)));
  cv::Mat mean;
  cv::resize(*texture, mean, coarse, 0.0, 0.0, cv::INTER_AREA);
  cv::resize(mean, mean, texture->size(), 0.0, 0.0, cv::INTER_LINEAR);
  cv::addWeighted(*texture, pattern, mean, 1.0 - pattern, 0.0, *texture);
}

}  // namespace vcharge
