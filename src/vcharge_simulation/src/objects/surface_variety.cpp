#include "objects/surface_variety.h"

#include <algorithm>
#include <initializer_list>

#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

struct Range {
  double SurfaceVariety::*value;
  double low, high;
};

// Draws the values in the order of their ranges.
SurfaceVariety drawVariety(uint64_t seed, std::initializer_list<Range> ranges) {
  SurfaceVariety variety;
  Random random(seed * 7717U + 19U);
  for (const Range& range : ranges) {
    variety.*range.value = random.uniform(range.low, range.high);
  }
  return variety;
}

}  // namespace

// The middle of each range is near what the published V-Charge images of a street and of a workshop show.
SurfaceVariety SurfaceVariety::outdoors(uint64_t seed) {
  if (seed == 0) {
    return {};
  }
  SurfaceVariety variety = drawVariety(seed, {{&SurfaceVariety::grain, 2.05, 2.75},
                                              {&SurfaceVariety::pattern, 0.35, 0.9},
                                              {&SurfaceVariety::leaf, 0.45, 0.75},
                                              {&SurfaceVariety::grain_size, 0.55, 0.7},
                                              {&SurfaceVariety::relief_m, 0.05, 0.07},
                                              {&SurfaceVariety::foliage, 0.25, 0.45}});
  variety.has_coarse_grain = true;
  return variety;
}

SurfaceVariety SurfaceVariety::indoors(uint64_t seed) {
  if (seed == 0) {
    return {};
  }
  return drawVariety(seed, {{&SurfaceVariety::grain, 0.5, 0.9},
                            {&SurfaceVariety::pattern, 0.35, 0.9},
                            {&SurfaceVariety::grain_size, 0.55, 0.7},
                            {&SurfaceVariety::relief_m, 0.005, 0.015}});
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
