#pragma once

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/kannala_brandt_camera.h"

namespace vcharge {

/// The Kannala-Brandt camera closest to another camera, and the remaining error.
struct EquidistantFit {
  KannalaBrandtCamera camera;
  double rms_px = 0.0;
  double max_px = 0.0;
  int num_samples = 0;
};

/// Least squares of the pixel distance between `camera` and the fit, over a regular grid of pixels whose rays
/// lie within field_of_view_rad / 2 of the axis: a linear solution, refined by Gauss-Newton over focal
/// lengths, centre and k1..k4. Throws std::invalid_argument if fewer than 50 pixels have a ray or the fit is
/// not one-to-one over the field of view.
EquidistantFit fitEquidistant(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad);

}  // namespace vcharge
