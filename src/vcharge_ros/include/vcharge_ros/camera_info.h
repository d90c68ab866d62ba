#pragma once

#include <string>

#include <sensor_msgs/CameraInfo.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/equidistant_fit.h"

namespace vcharge {

/// Pixel distance between a camera and what its CameraInfo says: 0 where that is exact, infinite where there
/// is no fit.
struct CameraInfoResidual {
  double rms_px = 0.0;
  double max_px = 0.0;
};

/// CameraInfo of a rig's camera; the header's stamp is left to the caller. sensor_msgs has no Mei model: it
/// carries an equidistant fit (ROS's name for Kannala-Brandt), for a pinhole camera plumb_bob; K stays zero
/// (ROS's sign for an uncalibrated camera) where no equidistant camera comes near.
sensor_msgs::CameraInfo makeCameraInfo(const RigCamera& camera, CameraInfoResidual* residual = nullptr);
/// The same for any other camera, for instance the working camera of a range map.
sensor_msgs::CameraInfo makeCameraInfo(const CameraModel& model, cv::Size image_size_px,
                                       double field_of_view_rad, const std::string& frame_id,
                                       CameraInfoResidual* residual = nullptr);

}  // namespace vcharge
