#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// One camera's view as an upright cylinder: columns are azimuths of the vehicle's axes, counter-clockwise
/// from right to left, rows are slopes (height over horizontal distance), so that upright things stand
/// upright, and get larger about the horizon's row when they come nearer. It has the resolution of the sensor
/// in the middle of the view. Immutable.
class Panorama {
 public:
  /// Needs the camera's extrinsics.
  explicit Panorama(const RigCamera& camera);

  /// CV_8UC1, bilinear, from an image of the sensor (CV_8UC1); 0 where there is none.
  cv::Mat render(const cv::Mat& image) const;
  /// CV_8UC1 of the panorama's size: not 0 where the camera sees.
  const cv::Mat& validMask() const { return valid_mask_; }
  /// Angle of a column, and slope of a row, near the horizon.
  double pixel_rad() const { return pixel_rad_; }
  double columnOf(double azimuth_rad) const;
  double rowOf(double slope) const { return (top_slope_ - slope) / pixel_rad_; }

 private:
  double pixel_rad_, middle_rad_, top_slope_;
  cv::Mat pixels_, fractions_;  // of the sensor, in OpenCV's fixed-point form
  cv::Mat valid_mask_;
};

}  // namespace vcharge
