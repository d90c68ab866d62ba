#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/fading_path.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Finds dirt on a lens: spots that stay in place in the images while the vehicle drives and turns. Over some
/// metres the ground averages out; what remains is dirt, and light that the vehicle takes along, such as its
/// shadow, which moves when it turns. So the logarithms of images are averaged apart for each direction of
/// travel, and dirt is what is brighter or darker than ground beside it, on both sides and in most
/// directions. Spots of up to 14 degrees are found, below the horizon only: far things ahead stay in place,
/// too. Deterministic; not thread safe.
class LensDirt {
 public:
  /// The camera must have extrinsics.
  explicit LensDirt(const RigCamera& camera);

  /// Adds the next image (CV_8UC1 of the camera's size).
  void add(const cv::Mat& pixels, const RigidTransform& odom_from_vehicle);
  /// Part of the visible ground that dirt covers; 0 until the vehicle has driven in two directions.
  double part() const;

 private:
  /// Pixel that shows the ground, and pixels that show it to both sides, by their index in images.
  struct GroundPixel {
    int32_t here, left, right;
  };
  static constexpr size_t kNumDirections = 6;
  static constexpr double kFade_m = 30.0;

  /// Images of one direction of travel.
  struct Direction {
    FadingPath path{kFade_m};
    cv::Mat mean, variance;  ///< CV_32FC1, of logarithms; empty before the first image
  };

  int spotOf(const Direction& direction, const GroundPixel& pixel) const;

  const WorkingCamera camera_;
  std::vector<GroundPixel> ground_;
  std::array<Direction, kNumDirections> directions_;
  std::optional<RigidTransform> odom_from_last_;
};

}  // namespace vcharge
