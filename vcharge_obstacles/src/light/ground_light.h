#pragma once

#include <opencv2/core.hpp>

#include "detection/pixel_rays.h"
#include "vcharge_core/motion/fading_path.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Light that the vehicle takes along, as that of its headlights: ground that gets into it becomes brighter
/// although nothing moves there. It is the mean brightness at each place in the image over the ground of the
/// last metres, smoothed, so that nothing narrower than a car is mistaken for it. Deterministic; not thread
/// safe.
class GroundLight {
 public:
  /// `rays` must outlive it.
  explicit GroundLight(const PixelRays& rays);

  /// The image (CV_8UC1) as if the light known from it and the images before were even: gray levels are
  /// multiplied by 1/3 to 3. It sets in over 2.5 m of driving, as images that follow each other must agree.
  cv::Mat even(const cv::Mat& image, const RigidTransform& fixed_from_vehicle);

  /// Forgets the light.
  void clear();

 private:
  double meanOnGround() const;

  const PixelRays& rays_;
  cv::Mat mean_;  // CV_32FC1
  FadingPath path_;
};

}  // namespace vcharge
