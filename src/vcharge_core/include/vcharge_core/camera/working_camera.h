#pragma once

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// How an image is brought from the sensor's camera to the working camera.
struct WorkingCameraOptions {
  double image_scale = 0.5;  ///< size of the working image over the size of the sensor's
  int width_px = 0;          ///< its width, whatever the sensor's, but no larger; 0: image_scale counts
  double focal_scale = 1.0;  ///< below 1 keeps more of the rim that undistortion pushes outwards

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("image_scale", image_scale);
    visit("width_px", width_px);
    visit("focal_scale", focal_scale);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
  /// Size of the working image over the sensor's, in (0, 1].
  double scaleOf(cv::Size sensor_size_px) const;
};

/// A camera whose images carry no distortion but keep the wide field of view: the unified model with xi kept
/// (Mei), xi = 0 (pinhole) or a fitted xi (Kannala-Brandt), focal lengths scaled, k = p = 0 (paper, section
/// Depth Map Computation). Its projection has a closed form in both directions. Immutable.
class WorkingCamera {
 public:
  /// field_of_view_rad and mask (empty, or CV_8UC1 of image_size_px, 0 where the vehicle is seen) are those
  /// of the sensor's camera. std::invalid_argument for bad options, std::logic_error for a mask of another
  /// size.
  WorkingCamera(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad,
                const cv::Mat& mask, const WorkingCameraOptions& options = WorkingCameraOptions());

  const MeiCamera& model() const { return model_; }
  cv::Size size() const { return size_; }
  /// CV_8UC1: 255 where the pixel's ray is inside the field of view, the sensor's image and the mask; else 0.
  const cv::Mat& validMask() const { return valid_mask_; }
  /// Sensor pixel that each working pixel shows (CV_32FC2); (-1, -1) where there is none.
  const cv::Mat& sensorPixels() const { return sensor_pixels_; }

  /// Undistorted image of the working camera's size: bilinear, 0 where there is no sensor pixel. Of images
  /// more than twice as large as the working camera's, blocks of pixels are averaged first.
  /// std::logic_error when `pixels` is not CV_8UC1 of the sensor's size.
  cv::Mat undistort(const cv::Mat& pixels) const;

 private:
  bool isValid(const cv::Mat& valid_blocks, const cv::Vec2f& sensor_pixel) const;

  MeiCamera model_;
  cv::Size size_;
  cv::Size sensor_size_;
  int block_px_;  // side of the blocks that are averaged
  cv::Mat valid_mask_;
  cv::Mat sensor_pixels_;
};

/// The working camera of range maps that have this model and size, rebuilt from the rig's camera that they
/// were made of. InputError when they were made with another rig.
WorkingCamera rebuildWorkingCamera(const MeiCamera& model, cv::Size size, const RigCamera& camera);

}  // namespace vcharge
