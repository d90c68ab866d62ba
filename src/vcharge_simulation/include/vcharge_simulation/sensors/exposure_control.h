#pragma once

#include "vcharge_simulation/sensors/camera_response.h"

namespace vcharge {

/// Automatic exposure of a camera. The logarithm of the exposure approaches, with a time constant, the value
/// at which a uniform image has the target gray value. The exposure time is used up to its limit before the
/// gain rises.
class ExposureControl {
 public:
  static constexpr double kMinTime_s = 5e-5, kMaxTime_s = 0.02;
  static constexpr double kMaxGain = 16.0;

  /// `normal_time_s` is the exposure time of the normal exposure.
  ExposureControl(double target_gray, double time_constant_s, double normal_time_s = 1e-3)
      : target_gray_(target_gray), time_constant_s_(time_constant_s), normal_time_s_(normal_time_s) {}

  Exposure exposure() const;
  /// Adapts to the mean gray value of an image taken with exposure(), `elapsed_s` before the next image.
  void observe(const CameraResponse& response, double mean_gray, double elapsed_s);

 private:
  double target_gray_, time_constant_s_, normal_time_s_;
  double product_ = 1.0;  // of factor and gain
};

}  // namespace vcharge
