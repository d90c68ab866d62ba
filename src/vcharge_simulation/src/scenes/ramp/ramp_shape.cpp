#include "scenes/ramp/ramp_shape.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

namespace {

constexpr double kTwoPi = 6.28318530717958647692;

// Height over a distance after which the slope is constant.
double rise(double along_m) {
  const double rounded_m = std::clamp(along_m, 0.0, kRampRounding_m);
  return kRampSlope *
         (0.5 * rounded_m * rounded_m / kRampRounding_m + std::max(0.0, along_m - kRampRounding_m));
}

}  // namespace

double rampHeightAt(double angle_rad) {
  const double along_m = kRampRadius_m * angle_rad;
  return rise(along_m) - rise(along_m - (kRampLength_m - kRampRounding_m));
}

double rampGroundHeight(double x_m, double y_m, double near_z_m) {
  double nearest_m = 0.0;
  bool is_solid = false;  // under its low beginning
  const auto consider = [&](double height_m) {
    if (is_solid || std::abs(height_m - near_z_m) <= std::abs(nearest_m - near_z_m)) {
      nearest_m = height_m;
    }
    is_solid = false;
  };
  if (std::abs(std::hypot(x_m, y_m) - kRampRadius_m) <= kRampHalfWidth_m) {
    double angle_rad = std::atan2(y_m, x_m);
    angle_rad += angle_rad < 0.0 ? kTwoPi : 0.0;
    is_solid = rampHeightAt(angle_rad) < kRampSkirt_m;
    for (; angle_rad <= kRampAngle_rad; angle_rad += kTwoPi) {
      consider(rampHeightAt(angle_rad));
    }
  }
  if (x_m <= 0.0 && x_m >= -kLandingLength_m && std::abs(y_m - kRampRadius_m) <= kRampHalfWidth_m) {
    consider(landingHeight());
  }
  return nearest_m;
}

}  // namespace vcharge
