#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// From light on the sensor to gray levels, and the sensor's noise.
struct CameraResponseOptions {
  double exposure = 0.7;         ///< gain on the light
  double shoulder = 1.6;         ///< light at which highlights are compressed by half; larger is more linear
  double gamma = 0.62;           ///< exponent of the gray curve
  double photon_noise = 1.5e-5;  ///< variance of the light per unit of light
  double read_noise = 5e-4;      ///< standard deviation of the light in the dark

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("exposure", exposure);
    visit("shoulder", shoulder);
    visit("gamma", gamma);
    visit("photon_noise", photon_noise);
    visit("read_noise", read_noise);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Gray curve: gray = 255 min(1, x (1 + w) / (x + w))^gamma with x = exposure * light and w = shoulder. Noise
/// is added to noise-free images, so that one rendering serves many noisy drives. Immutable, thread safe.
class CameraResponse {
 public:
  explicit CameraResponse(const CameraResponseOptions& options = CameraResponseOptions());

  /// Converts light (CV_32FC1) to gray (CV_8UC1) without noise.
  cv::Mat develop(const cv::Mat& light) const;

  /// Adds photon and read noise to a noise-free image (CV_8UC1) at `gain` times the exposure. The result
  /// depends only on the arguments.
  cv::Mat addNoise(const cv::Mat& clean, uint64_t seed, int camera, int64_t frame, double gain = 1.0) const;

  /// Noise-free image (CV_8UC1) at `gain` times the exposure.
  cv::Mat expose(const cv::Mat& clean, double gain) const;

  /// Gray value in [0, 255], not rounded, of an amount of light.
  double grayFromLight(double light) const;
  /// Inverse of grayFromLight, for gray in [0, 255].
  double lightFromGray(double gray) const;

 private:
  CameraResponseOptions options_;
  std::vector<uint8_t> gray_by_root_light_;
};

}  // namespace vcharge
