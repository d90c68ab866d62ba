#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Exposure of an image relative to the normal exposure. The collected light has shot noise; the gain then
/// amplifies signal and noise alike.
struct Exposure {
  double factor = 1.0;  ///< collected light relative to that of the normal exposure
  double gain = 1.0;    ///< sensor gain
};

/// Response of the sensor: gray = 255 min(1, x (1 + w) / (x + w))^gamma with x = exposure * light and w =
/// shoulder. Noise is added to noise-free images, so that one rendering serves many noisy drives. Immutable,
/// thread safe.
class CameraResponse {
 public:
  // Chosen so that gray levels and the residual of smooth regions are near those of the V-Charge images.
  static constexpr double kExposure = 0.7;
  static constexpr double kShoulder = 1.6;  ///< light at which highlights are compressed by half
  static constexpr double kGamma = 0.62;
  static constexpr double kPhotonNoise = 1.5e-5;  ///< variance of the exposed light per unit of light
  static constexpr double kReadNoise = 5e-4;      ///< standard deviation of the exposed light in the dark

  CameraResponse();

  /// Converts light (CV_32FC1) to gray (CV_8UC1) without noise.
  cv::Mat develop(const cv::Mat& light) const;

  /// Adds photon and read noise to light (CV_32FC1), or to a noise-free image at the normal exposure
  /// (CV_8UC1). The result (CV_8UC1) depends only on the arguments.
  cv::Mat addNoise(const cv::Mat& clean, uint64_t seed, int camera, int64_t frame,
                   const Exposure& exposure = Exposure()) const;

  /// The same without noise.
  cv::Mat expose(const cv::Mat& clean, const Exposure& exposure) const;

  /// Gray value in [0, 255], not rounded, of an amount of light.
  double grayFromLight(double light) const;
  /// Inverse of grayFromLight, for gray in [0, 255].
  double lightFromGray(double gray) const;

 private:
  std::vector<uint8_t> gray_by_root_light_;
};

}  // namespace vcharge
