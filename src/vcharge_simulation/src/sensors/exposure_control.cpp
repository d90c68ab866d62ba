#include "vcharge_simulation/sensors/exposure_control.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

namespace {

// A black image only says that it is darker than the first gray level.
constexpr double kDarkestGray = 1.0;

}  // namespace

Exposure ExposureControl::exposure() const {
  const double factor = std::min(product_, kMaxTime_s / normal_time_s_);
  return {factor, product_ / factor};
}

void ExposureControl::observe(const CameraResponse& response, double mean_gray, double elapsed_s) {
  const double ratio =
      response.lightFromGray(target_gray_) / response.lightFromGray(std::max(kDarkestGray, mean_gray));
  const double fraction = time_constant_s_ > 0.0 ? 1.0 - std::exp(-elapsed_s / time_constant_s_) : 1.0;
  product_ = std::clamp(product_ * std::pow(ratio, fraction), kMinTime_s / normal_time_s_,
                        kMaxTime_s / normal_time_s_ * kMaxGain);
}

}  // namespace vcharge
