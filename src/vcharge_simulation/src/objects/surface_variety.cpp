#include "objects/surface_variety.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

SurfaceVariety SurfaceVariety::fromSeed(uint64_t seed) {
  SurfaceVariety variety;
  if (seed != 0) {
    Random random(seed * 7717U + 19U);
    // The middle of each range is near what the published V-Charge images of a street show.
    variety.grain = 1.4 * std::pow(2.0, random.uniform());
    variety.pattern = random.uniform(0.35, 0.9);
    variety.leaf = random.uniform(0.45, 0.75);
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
