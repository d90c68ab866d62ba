#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Size and focal length of the working camera.
struct WorkingCameraOptions {
  VCHARGE_BEGIN_OPTIONS(WorkingCameraOptions);
  VCHARGE_OPTION(double, image_scale, 0.5, above(0.0).upTo(1.0),
                 "Ratio of the working image's size to the sensor's; unused if width_px is set.");
  VCHARGE_OPTION(int, width_px, 0, notNegative(),
                 "Largest width of the working image; 0: set by image_scale.");
  VCHARGE_OPTION(double, focal_scale, 1.0, above(0.0).upTo(4.0),
                 "Factor of the focal length; below 1, more of the rim is kept.");
  VCHARGE_END_OPTIONS();

  /// Ratio of the working image's size to the sensor's, in (0, 1].
  double scaleOf(cv::Size sensor_size_px) const;
};

/// A camera without distortion that keeps the wide field of view: the unified model with xi kept (Mei), xi =
/// 0 (pinhole) or a fitted xi (Kannala-Brandt), focal lengths scaled, k = p = 0 (paper, section Depth Map
/// Computation). Projection and its inverse have closed forms. Immutable.
class WorkingCamera {
 public:
  /// `field_of_view_rad` and `mask` (empty, or CV_8UC1 of image_size_px, 0 where the vehicle is seen) belong
  /// to the sensor's camera. Throws std::invalid_argument for bad options, std::logic_error for a mask of
  /// another size.
  WorkingCamera(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad,
                const cv::Mat& mask, const WorkingCameraOptions& options = WorkingCameraOptions());

  const MeiCamera& model() const { return model_; }
  cv::Size size() const { return size_; }
  /// CV_8UC1: 255 where the ray is inside the field of view, the sensor image and the mask; otherwise 0.
  const cv::Mat& validMask() const { return valid_mask_; }
  /// The sensor pixel shown by each working pixel (CV_32FC2); (-1, -1) where there is none.
  const cv::Mat& sensorPixels() const { return sensor_pixels_; }

  /// Undistorts an image by bilinear sampling; 0 where there is no sensor pixel. If the sensor image is more
  /// than twice as large as the working image, blocks of pixels are averaged first. Throws std::logic_error
  /// unless `pixels` is CV_8UC1 of the sensor's size.
  cv::Mat undistort(const cv::Mat& pixels) const;

 private:
  /// A pixel that shows something: the first of the four blocks it is interpolated from, and the weights of
  /// the others.
  struct Sample {
    int32_t pixel, block;
    float right, down;
  };
  bool isValid(const cv::Mat& valid_blocks, const cv::Vec2f& sensor_pixel) const;
  std::vector<Sample> makeSamples() const;

  MeiCamera model_;
  cv::Size size_;
  cv::Size sensor_size_;
  int block_px_;  // side length of the averaged blocks
  cv::Mat valid_mask_;
  cv::Mat sensor_pixels_;
  std::shared_ptr<const std::vector<Sample>> samples_;  // by pixel
};

/// Reconstructs from the rig the working camera that range maps of this model and size were made with. Throws
/// InputError if they were made with another rig.
WorkingCamera rebuildWorkingCamera(const MeiCamera& model, cv::Size size, const RigCamera& camera);

}  // namespace vcharge
