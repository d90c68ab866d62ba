#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge::testing {

/// A front and a left fisheye camera on a car.
std::shared_ptr<const CameraRig> makeTestRig();

struct TestDriveOptions {
  int num_keyframes = 40;
  double step_m = 0.5;
  double turn_rad = 0.05;       ///< turn per keyframe
  double odometry_scale = 1.0;  ///< ratio of counted to true distance
  double noise_px = 0.0;        ///< standard deviation of an observed position
  int num_points = 600;
  uint32_t seed = 1;
  /// When the two cameras expose their images; the speed then differs from keyframe to keyframe. Empty: all
  /// pixels at the stamp.
  std::vector<ImageTiming> timings;
  std::vector<double> image_offsets_s;  ///< of the two cameras' images, see ImageMotion
};

/// A drive along a circle among random points, with true poses, and exact (or noisy) observations of every
/// point that a camera sees within 25 m, as tracks of consecutive keyframes with true positions.
ReconstructionData makeTestDrive(const TestDriveOptions& options);

}  // namespace vcharge::testing
