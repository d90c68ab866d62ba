#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// Gray levels of one place on the ground in two cameras, and the angles from their optical axes, see
/// GroundProjection.
struct GrayPair {
  uint8_t first_camera, second_camera;
  uint8_t first_gray, second_gray;
  uint8_t first_angle = 0, second_angle = 0;
};

/// Factors with which cameras show the same ground equally bright: a gain of each camera, and the darkening
/// of the images towards the rim, which all lenses have in common. Found by least squares from medians over
/// places that two cameras see at about the same two angles, robustly, and smoothed over time: things that
/// stand in an overlap, and look different from both sides, hardly change them.
class ExposureBalance {
 public:
  explicit ExposureBalance(size_t num_cameras);

  /// Takes the pairs of one frame. Without pairs, nothing changes.
  void update(const std::vector<GrayPair>& pairs);

  /// Factor of the gray levels in the middle of the image, by camera; the mean of their logarithms is 0.
  const std::vector<double>& gains() const { return gains_; }
  /// As in SurroundFrame.
  std::array<double, 2> shading() const { return {shading_[0], shading_[1]}; }
  /// Factor that makes up for the darkening at an angle.
  double brightening(uint8_t angle) const;

 private:
  static constexpr size_t kNumAngleBins = 8;
  static constexpr Eigen::Index kNumShading = 2;
  struct Ratio {
    size_t first = 0, second = 0;
    double log_ratio = 0.0;  // of the brightness in the first to that in the second camera
    double weight = 0.0;
    Eigen::Vector2d shading = Eigen::Vector2d::Zero();  // basis of the first minus that of the second
  };
  std::vector<Ratio> medianRatios(const std::vector<GrayPair>& pairs);
  Eigen::VectorXd solve(const std::vector<Ratio>& ratios) const;

  std::vector<double> log_gains_, gains_;
  Eigen::Vector2d shading_ = Eigen::Vector2d::Zero();  // coefficients of the logarithm of the brightness
  std::vector<uint8_t> is_known_;                      // whether a camera has been compared with another one
  std::vector<std::vector<GrayPair>> groups_;  // by both cameras and angles; kept to avoid allocations
};

}  // namespace vcharge
