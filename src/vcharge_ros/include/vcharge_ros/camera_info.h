#pragma once

#include <string>

#include <sensor_msgs/CameraInfo.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/equidistant_fit.h"

namespace vcharge {

/// Pixel distance between a camera and the model in its CameraInfo: 0 if that model is exact, infinite if no
/// distortion model of sensor_msgs fits.
struct CameraInfoResidual {
  double rms_px = 0.0;
  double max_px = 0.0;
};

/// CameraInfo of a rig's camera; the caller sets the header's stamp. sensor_msgs has no Mei model, so the
/// message holds an equidistant fit (Kannala-Brandt in ROS), or plumb_bob for a pinhole camera. K stays zero
/// (ROS's convention for an uncalibrated camera) if no equidistant camera is close enough.
sensor_msgs::CameraInfo makeCameraInfo(const RigCamera& camera, CameraInfoResidual* residual = nullptr);
/// The same for any other camera, for instance the working camera of a range map.
sensor_msgs::CameraInfo makeCameraInfo(const CameraModel& model, cv::Size image_size_px,
                                       double field_of_view_rad, const std::string& frame_id,
                                       CameraInfoResidual* residual = nullptr);

}  // namespace vcharge
