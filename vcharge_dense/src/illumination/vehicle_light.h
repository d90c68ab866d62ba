#pragma once

#include <opencv2/core.hpp>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/motion/fading_path.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Light on the ground that moves with the vehicle: its own shadow by day, its headlights by night. Their
/// edges keep their place in the image while the ground passes below them, so that windows across them match
/// at no range. What stays in the logarithms of the images while the ground moves by many pixels is this
/// light (Weiss 2001: the reflectance changes, the illumination is common to all images); it is divided out.
///
/// Not thread safe. Results depend on the order of the images only.
class VehicleLight {
 public:
  /// `valid_mask`: CV_8UC1 of the images' size, not 0 where pixels may be used.
  VehicleLight(const MeiCamera& camera, const cv::Mat& valid_mask, const RigidTransform& vehicle_from_camera);

  /// The image (CV_8UC1 of the mask's size) without the light known from it and the images before.
  /// The image itself is returned where no light is known: in the first metres, and after turns, which move
  /// the shadow.
  cv::Mat removeFrom(const cv::Mat& image, const RigidTransform& world_from_camera);

  /// Forgets the light.
  void clear();

 private:
  void remember(const cv::Mat& log_image, double share);
  cv::Mat correction() const;

  cv::Mat ground_;           // CV_32FC1: 1 where pixels show near ground, otherwise 0
  cv::Mat ground_around_;    // its mean around each pixel
  cv::Mat motion_px_per_m_;  // CV_32FC1: motion of the ground while the vehicle drives straight
  cv::Mat mean_, variance_;  // CV_32FC1: of logarithms
  FadingPath path_;
};

}  // namespace vcharge
